"""Driving to goals: plan, follow, and plan again when the world changes."""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, inf

import numpy as np

from stack.control.checkers import LostChecker
from stack.costmap.route_costs import blocked_at, route_cost
from stack.errors import NavigationError
from stack.navigation.blockages import Blockages
from stack.navigation.following import (
    IDLE_BEFORE_REPLAN,
    Follower,
    Tools,
    check_not_lost,
    drive_feedback,
    standing,
)
from stack.navigation.planner_worker import Plan, PlanRequest
from stack.navigation.tasks import MotionTask, NavigationState
from stack.types import STANDSTILL, Failure, FailureCode, Path, Pose2D, Twist

HOPELESS = frozenset({FailureCode.GOAL_OUTSIDE_MAP, FailureCode.START_OUTSIDE_MAP})
"""Failures that waiting does not mend."""

MOST_CORRECTIONS = 3
"""How often a car that stands at the goal with another heading tries to mend that."""

RECEDING = 0.02
"""Metres by which a pose on the way must have come farther again to lie behind."""

NEAR_ENOUGH = 0.5
"""Metres before the end of a partial path within which an obstacle is what was to be expected:
standing before it is having come there, and no reason to look for another place as near.
"""

ON_ITS_WAY = 0.1
"""Metres that a robot without a plan must come, again and again, to count as driving on: what it
inches forward before an obstacle is no reason to hope.
"""

HELD = frozenset({FailureCode.COLLISION_AHEAD, FailureCode.NO_PROGRESS})
"""Failures of a robot that stands before an obstacle."""

OTHER_ROUTES = "the routes have changed"
"""The reason of a plan by another planner than the path in force: an edge was closed or opened."""

ROUTINE = ""
"""The reason of a plan made only to see whether there is a better path."""


class GoalDrive:
    """Drives past goals in turn to the last one.

    Attributes:
        task: its handle.
        path: in force; None while there is none.
        goal: the last one.
        partial: having come as near to it as can be is success; otherwise, where the planner
            makes partial plans at all, it is NO_VALID_PATH, said when it has come there.
    """

    partial = False

    def __init__(
        self, task: MotionTask, tools: Tools, goals: Sequence[Pose2D], tolerance: float | None
    ) -> None:
        self.task, self.goal = task, goals[-1]
        self.path: Path | None = None
        self._tools, self._goals, self._tolerance = tools, tuple(goals), tolerance
        self._follower = Follower(tools, tolerance)
        self._lost = LostChecker(tools.parameters.lost_health, tools.parameters.lost_time)
        self._reason = "first plan"
        self._asked_at = -inf
        self._failing_since: float | None = None
        self._failing_at = Pose2D(0.0, 0.0)
        self._leg_ends: tuple[float, ...] = ()
        self._nearest = inf
        self._seen_version = -1
        self._blocked_at: tuple[float, float] | None = None
        self._blockages = Blockages()
        self._planner = self._asked_of = tools.planner_worker.planner
        self._corrections = 0

    def advance(self, state: NavigationState) -> Twist:
        """The velocity for this step."""
        try:
            check_not_lost(self._lost, state)
            if self._lost.doubted:
                return self._stand("the scans do not fit the map: waiting")
            self._take_plan(state)
            self._pass_goals(state.estimate.pose)
            if self._follower.reached(state) and len(self._goals) == 1:
                self._arrive(state.estimate.pose)
                return STANDSTILL
            self._ask_if_needed(state)
            self._report()
            return STANDSTILL if self.path is None else self._follower.advance(state)
        except NavigationError as error:
            if self._near_a_partial_end and error.failure.code in HELD:
                self._arrive(state.estimate.pose)
            self.task.fail(error.failure.code, error.failure.sentence)
            return STANDSTILL

    @property
    def _near_a_partial_end(self) -> bool:
        """Whether it is where what keeps it from the goal may hold it up: that is no news."""
        track = self._follower.track
        partial = self.path is not None and self.path.partial
        return partial and track is not None and track.remaining <= NEAR_ENOUGH

    def _stand(self, why: str) -> Twist:
        """Stand while the pose is in doubt: a path from a wrong pose leads anywhere."""
        self.task.report(why, self.task.distance_remaining)
        return STANDSTILL

    def _report(self) -> None:
        track = self._follower.track
        remaining = 0.0 if track is None else track.remaining
        self.task.report(drive_feedback(self._follower), remaining)

    def _arrive(self, pose: Pose2D) -> None:
        """The end of the path: the goal, or what was nearest to it."""
        away = f"{pose.distance_to(self.goal):.2f} m from the goal"
        if self.path is None or not self.path.partial:
            self.task.succeed(f"there, {away}")
        elif self.partial:
            self.task.succeed(f"as near as there is a way to, {away}")
        else:
            self.task.fail(
                FailureCode.NO_VALID_PATH,
                f"there is no way to the goal; came as near to it as there is one, to "
                f"({pose.x:.2f}, {pose.y:.2f}), {away}",
            )

    def _pass_goals(self, pose: Pose2D) -> None:
        """Strike out the goals on the way that lie behind.

        One is behind when the robot was near enough and moves away from it again, or cannot come
        nearer, or when it has driven that much of the path.
        """
        track = self._follower.track
        if track is None:
            return
        track.advance(pose)
        while len(self._goals) > 1 and len(self._leg_ends) == len(self._goals):
            distance = pose.distance_to(self._goals[0])
            self._nearest = min(self._nearest, distance)
            receding = distance > self._nearest + RECEDING or self._follower.waiting
            near = self._nearest <= self._tools.parameters.via_radius
            if not (near and receding) and track.travelled < self._leg_ends[0]:
                break
            self._goals, self._leg_ends = self._goals[1:], self._leg_ends[1:]
            self._nearest = inf

    def _ask_if_needed(self, state: NavigationState) -> None:
        """Ask for a plan when there is a reason to, no more often than the interval allows."""
        p = self._tools.parameters
        self._look_ahead(state.estimate.pose)
        if self.task.future is not None or state.time < self._asked_at + p.replan_interval - 1e-9:
            return
        reason = self._why_replan(state)
        if reason is None:
            return
        twist = state.odometry.twist
        direction = 0 if standing(twist) else int(copysign(1, twist.linear))
        pose = state.estimate.pose
        request = PlanRequest(self._tools.world.grid, pose, self._goals, self.partial, direction)
        due = state.time + p.planning_latency
        self.task.future = self._tools.planner_worker.ask(request, due, wait=p.wait_for_plan)
        self._reason, self._asked_at = reason, state.time
        self._asked_of = self._tools.planner_worker.planner

    def _look_ahead(self, pose: Pose2D) -> None:
        """Whether the next metres of the path are blocked; looked at when the costs changed."""
        track, world = self._follower.track, self._tools.world
        if track is None or world.version == self._seen_version:
            return
        self._seen_version = world.version
        points = track.ahead(self._tools.parameters.look_ahead)
        if self.path is not None and self.path.partial:
            end = self.path.goal
            points = points[np.hypot(points[:, 0] - end.x, points[:, 1] - end.y) > NEAR_ENOUGH]
        self._blocked_at = blocked_at(world.grid, points, pose, self._tools.clear_of)

    def _why_replan(self, state: NavigationState) -> str | None:
        """Why to plan now; ROUTINE to look for a better path, None for no reason."""
        p, follower, track = self._tools.parameters, self._follower, self._follower.track
        if self.path is None or track is None:
            return "first plan"
        if self._tools.planner_worker.planner is not self._planner:
            return OTHER_ROUTES
        if self._near_a_partial_end:
            return self._routine(state.time)
        if follower.waiting:
            return "something is in the way"
        if self._blocked_at is not None:
            return "the path ahead is blocked"
        if track.offset > p.off_path:
            return f"{track.offset:.1f} m off the path"
        idle = follower.idle_since
        if follower.at_position:
            return self._correction(state)
        if idle is not None and state.time - idle >= IDLE_BEFORE_REPLAN:
            return "stopped short of the goal"
        return self._routine(state.time)

    def _routine(self, time: float) -> str | None:
        due = time >= self._asked_at + self._tools.parameters.replan_period - 1e-9
        return ROUTINE if due else None

    def _correction(self, state: NavigationState) -> str | None:
        """Why a car that stands at the goal's position needs another plan; None if it does not."""
        off = self._follower.off_heading(state)
        if not off:
            return None
        if self._corrections >= MOST_CORRECTIONS:
            raise NavigationError(
                FailureCode.NO_PROGRESS,
                f"{off}; {MOST_CORRECTIONS} more plans did not mend that. Leave more room round "
                "the goal, or plan with hybrid_astar or lattice and the robot's turning radius",
            )
        self._corrections += 1
        return "at the goal's position, off its heading"

    def _take_plan(self, state: NavigationState) -> None:
        """Use the plan asked for, once its time has come."""
        future = self.task.future
        answer = None if future is None else future.result(state.time)
        if future is None or answer is None:
            return
        self.task.future = None
        self._tools.count("plans")
        if isinstance(answer, Plan):
            answer = self._unless_too_far(answer)
        if isinstance(answer, Failure):
            self._planner = self._asked_of
            self._no_way(answer, state)
            return
        self._failing_since = None
        if future.request.goals != self._goals:
            self._asked_at = -inf  # one was passed meanwhile: the plan leads back to it
            return
        self._planner = self._asked_of
        if self._reason != ROUTINE or self._clearly_better(answer, state.time):
            self._adopt(answer, state.time)

    def _unless_too_far(self, plan: Plan) -> Plan | Failure:
        """The plan, unless it ends farther from the goal than the task tolerates."""
        distance = plan.path.goal.distance_to(self.goal)
        if self._tolerance is None or distance <= self._tolerance or plan.path.partial:
            return plan
        return Failure(
            FailureCode.GOAL_OCCUPIED,
            f"the nearest place to the goal that can be reached is {distance:.2f} m away from it, "
            f"the tolerance {self._tolerance:.2f} m",
        )

    def _no_way(self, failure: Failure, state: NavigationState) -> None:
        """A plan failed: drive on while there is a path to drive, else try until patience ends."""
        if failure.code in HOPELESS:
            raise NavigationError(FailureCode(failure.code), failure.sentence)
        if self._reason == ROUTINE:
            return
        if self._reason == OTHER_ROUTES:
            self.path = None  # what was closed must not be driven on
        here = state.odometry.pose
        if self._failing_since is None or (
            self.path is not None and self._failing_at.distance_to(here) > ON_ITS_WAY
        ):
            self._failing_since, self._failing_at = state.time, here
        if state.time - self._failing_since >= self._tools.parameters.patience:
            raise NavigationError(FailureCode(failure.code), failure.sentence)

    def _clearly_better(self, plan: Plan, time: float) -> bool:
        """Whether a plan is worth leaving the path in force for."""
        track = self._follower.track
        if track is None or self.path is None:
            return True
        if self._blockages.bar(plan.path.points, time):
            return False
        closer = self.path.goal.distance_to(self.goal) - plan.path.goal.distance_to(self.goal)
        if plan.path.partial and self.path.partial:
            return closer > NEAR_ENOUGH  # on the other side of a table it may be nearer by a cell
        if closer > 0.02:
            return True
        costs = self._tools.world.grid
        now = route_cost(costs, track.ahead(inf))
        new = route_cost(costs, plan.path.points)
        return new < (1.0 - self._tools.parameters.replan_gain) * now - 0.1

    def _adopt(self, plan: Plan, time: float) -> None:
        first = self.path is None
        if self._blocked_at is not None:
            self._blockages.note(self._blocked_at, time)
        self.path, self._leg_ends = plan.path, plan.leg_ends
        self.task.path = plan.path
        self._follower.set_path(plan.path)
        self._blocked_at, self._seen_version = None, -1
        length = round(plan.path.length, 3)
        if first:
            self._tools.emit("plan", f"plan found, {length:.1f} m", length=length)
            return
        reason = self._reason or "a better path"
        self._tools.count("replans")
        self._tools.emit(
            "replan", f"new plan, {length:.1f} m: {reason}", length=length, reason=reason
        )
