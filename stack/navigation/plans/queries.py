"""Plan queries: plans that are computed without driving them."""

from __future__ import annotations

from dataclasses import dataclass

from stack.navigation.drive_tools import DriveTools
from stack.navigation.plans.closed_passages import explained
from stack.navigation.plans.planner_worker import Plan, PlanRequest
from stack.navigation.tasks import MotionTask
from stack.types import Perceived, Pose2D


@dataclass
class _Planning:
    """A running `plan` task."""

    task: MotionTask
    goal: Pose2D
    start: Pose2D | None


class PlanQueries:
    """The running `plan` tasks; they do not move the robot and are independent of each other."""

    def __init__(self, tools: DriveTools) -> None:
        self._tools = tools
        self._under_way: list[_Planning] = []

    def begin(self, task: MotionTask, goal: Pose2D, start: Pose2D | None) -> None:
        """Plan to a goal, from the next step on; without a start, from the robot's pose."""
        self._under_way.append(_Planning(task, goal, start))

    def cancel(self, why: str) -> None:
        """Cancel all plan tasks."""
        for planning in self._under_way:
            planning.task.cancel(why)

    def step(self, perceived: Perceived) -> None:
        """Request plans and deliver finished ones."""
        for planning in self._under_way:
            if planning.task.running:
                self._step(planning, perceived)
        self._under_way = [item for item in self._under_way if item.task.running]

    def _step(self, planning: _Planning, perceived: Perceived) -> None:
        tools, p, task = self._tools, self._tools.parameters, planning.task
        if task.future is None:
            start = planning.start or perceived.estimate.pose
            copy = tools.global_costmap.copied()
            request = PlanRequest(copy.grid, start, (planning.goal,))
            due = p.plan_due(perceived.time)
            task.future = tools.planner_worker.ask(request, due, over=copy.release)
            task.report("planning", 0.0)
        answer = task.future.result(perceived.time)
        if isinstance(answer, Plan):
            task.path = answer.path
            task.succeed(f"plan found, {answer.path.length:.1f} m")
        elif answer is not None:
            start = task.future.request.start
            answer = explained(answer, tools, start, (planning.goal,))
            task.fail(answer.code, answer.sentence)
