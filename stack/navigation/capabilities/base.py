"""The base of a robot that the stack drives: begins motions, each of which is a task."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from math import degrees

from stack.components import Estimator
from stack.errors import NavigationError, ParameterError
from stack.navigation.activities import Activities
from stack.navigation.disambiguation import Disambiguation
from stack.navigation.drive_to_goal import GoalDrive
from stack.navigation.drive_tools import DriveTools
from stack.navigation.escape.escape import EscapeGoal
from stack.navigation.following import PathDrive
from stack.navigation.parameters import NavigationParameters
from stack.navigation.plans.queries import PlanQueries
from stack.navigation.recoveries import (
    BackUpMotion,
    DriveForMotion,
    DriveOnHeadingMotion,
    DriveOrder,
    SpinMotion,
    StraightLine,
)
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.navigation.teleoperation import Teleoperation
from stack.robot import Base
from stack.types import (
    STANDSTILL,
    ContactZone,
    CurrentStep,
    FailureCode,
    Footprint,
    Path,
    Pose2D,
    Twist,
)

VIEW_TOLERANCE = 0.3
"""Goal tolerance at a place from which rival poses look different, m."""


class StackBase(Base):
    """Begins the motions of the navigator; a new one cancels the current one.

    Args:
        tools: of drives.
        activities: runs the motions, and decides what moves while the robot is lost.
        queries: runs plans without motion.
        estimator: knows rival poses, and where they look different.
        now: what the step has perceived.
        cover: without a map, grows the costmaps to contain some poses.
    """

    def __init__(  # noqa: PLR0913 - what it needs of the stack
        self, tools: DriveTools, activities: Activities, queries: PlanQueries,
        estimator: Estimator, now: CurrentStep, cover: Callable[[Iterable[Pose2D]], None],
    ) -> None:  # fmt: skip
        self._robot, self._tools, self._activities = tools.robot, tools, activities
        self._queries, self._monitor, self._estimator = queries, activities.monitor, estimator
        self._now, self._cover = now, cover

    @property
    def odometry(self) -> Pose2D:
        return self._now.perceived.motion.pose

    @property
    def speed(self) -> Twist:
        return self._now.perceived.motion.twist

    @property
    def footprint(self) -> Footprint:
        return self._robot.footprint

    def held(self, since: float) -> str:
        return self._tools.held(since, self._now.perceived.time)

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False
    ) -> MotionTask:
        return self._drive_through([goal], tolerance, partial)

    def navigate_through(
        self, goals: Sequence[Pose2D], *, tolerance: float | None = None
    ) -> MotionTask:
        if not goals:
            raise ParameterError("goals", "expected at least one pose, got an empty list")
        return self._drive_through(goals, tolerance, partial=False)

    def _drive_through(
        self, goals: Sequence[Pose2D], tolerance: float | None, partial: bool
    ) -> MotionTask:
        self._cover(goals)
        task = self._activities.task(f"drive to {_text(goals[-1])}")
        drive = GoalDrive(task, self._tools, goals, tolerance, partial=partial)
        vias = f" via {len(goals) - 1} poses" if len(goals) > 1 else ""
        text = f"goal {_text(goals[-1])} accepted{vias}"
        self._activities.start(self._unless_ambiguous(drive), "goal", text)
        return task

    def _unless_ambiguous(self, drive: GoalDrive) -> MotionExecutor:
        """Return a drive to a goal that stands and tells rival poses apart while there are any."""
        if self._parameters.ambiguous_goals == "disambiguate":
            return self._disambiguation(drive.task, drive)
        return drive

    def disambiguate(self) -> MotionTask:
        task = self._activities.task("disambiguate")
        self._activities.start(
            self._disambiguation(task), "recovery", "telling the possible poses apart"
        )
        return task

    def _disambiguation(self, task: MotionTask, then: GoalDrive | None = None) -> Disambiguation:
        return Disambiguation(
            task, self._estimator, self._parameters, self._view_drive, self._monitor, then
        )

    def _view_drive(self, view: Pose2D) -> GoalDrive:
        """Return the drive to a place where rival poses differ, map frame of the estimate."""
        task = MotionTask(f"drive to {_text(view)}", lambda _: None)
        self._tools.emit("view", f"driving to {_text(view)}, where the possible poses differ")
        return GoalDrive(
            task, self._tools, [view], VIEW_TOLERANCE, partial=True, while_ambiguous=True
        )

    def follow_path(self, path: Path) -> MotionTask:
        if len(path.points) < 2:
            raise ParameterError("path", f"expected at least 2 points, got {len(path.points)}")
        task = self._activities.task(f"follow a path of {path.length:.1f} m")
        self._activities.start(
            PathDrive(task, self._tools, path), "goal", f"path of {path.length:.1f} m accepted"
        )
        return task

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> MotionTask:
        self._cover([goal])
        task = self._activities.task(f"plan to {_text(goal)}", moves=False)
        self._queries.begin(task, goal, start)
        return task

    def set_edge(self, edge: str, *, closed: bool) -> None:
        worker = self._tools.planner_worker
        worker.use(worker.planner.with_edge(edge, closed=closed))
        text = f"edge {edge} is now {'closed' if closed else 'open'}"
        self._tools.emit("route", text, edge=edge)

    @property
    def _parameters(self) -> NavigationParameters:
        return self._tools.parameters

    def spin(
        self, angle: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        task = self._activities.task(f"spin {degrees(angle):.0f} deg", while_lost=while_lost)
        rate = _positive("speed", self._parameters.spin_speed if speed is None else speed)
        refusal = SpinMotion.unsupported_reason(self._robot)
        if refusal:
            task.fail(FailureCode.UNSUPPORTED, refusal)
            return task
        return self._recover(SpinMotion(task, angle, rate, self._tools.motions.tools))

    def back_up(
        self, distance: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        _positive("distance", distance)
        _positive("reverse_speed", self._robot.limits.reverse_speed)
        task = self._activities.task(f"back up {distance:.2f} m", while_lost=while_lost)
        rate = _positive("speed", self._parameters.back_up_speed if speed is None else speed)
        return self._recover(BackUpMotion(task, distance, rate, self._tools.motions.tools))

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0,
        while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        rate = _positive("speed", self._parameters.straight_speed if speed is None else speed)
        line = StraightLine(distance, direction, rate)
        task = self._activities.task(
            f"drive {distance:.2f} m on its heading", while_lost=while_lost
        )
        refusal = line.unsupported_reason(self._robot)
        if refusal:
            task.fail(FailureCode.UNSUPPORTED, refusal)
            return task
        return self._recover(DriveOnHeadingMotion(task, line, self._tools.motions.tools))

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5,
        speed: float | None = None, while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        motions, p = self._tools.motions, self._parameters
        escape_goal = EscapeGoal(
            _positive("clearance", motions.room_to_turn if clearance is None else clearance),
            _positive("distance", distance),
            _positive("speed", p.escape_speed if speed is None else speed),
            p.spin_speed,
        )
        task = self._activities.task("escape to free space", while_lost=while_lost)
        is_lost, way_out = self._monitor.refuses(p), self._tools.global_costmap.way_out
        if way_out is not None and not is_lost:
            return self._recover(GoalDrive(task, self._tools, [way_out], None))
        known = None if is_lost else self._now.perceived
        return self._recover(motions.escape(task, escape_goal, known))

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> MotionTask:  # fmt: skip
        monitor, current = self._monitor, self._activities.current
        may_move = while_lost or twist == STANDSTILL
        refused = not may_move and self._parameters.lost_motions == "refuse"
        if refused and monitor.refuses(self._parameters):
            raise NavigationError(FailureCode.LOST, monitor.refusal(self._estimator.estimate))
        order = DriveOrder(twist, seconds, contact, gives_way=gives_way, while_lost=may_move)
        if isinstance(current, DriveForMotion):
            current.renew(order, self._now.perceived.time)
            return current.task
        task = self._activities.task("drive on command")
        begun = DriveForMotion(task, order, self._now.perceived.time)
        self._activities.start(begun, "goal", "driving on command")
        return task

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> MotionTask:
        task = self._activities.task("assisted teleoperation", while_lost=True)
        return self._recover(Teleoperation(task, seconds, silence))

    @property
    def teleoperation(self) -> Teleoperation | None:
        """The running teleoperation task, None without one; accepts the operator's velocities."""
        current = self._activities.current
        return current if isinstance(current, Teleoperation) else None

    def _recover(self, executor: MotionExecutor) -> MotionTask:
        self._activities.start(executor, "recovery", executor.task.what)
        return executor.task


def _text(pose: Pose2D) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f}, {degrees(pose.heading):.0f} deg)"


def _positive(name: str, value: float) -> float:
    if not value > 0.0:
        raise ParameterError(name, f"{value:g} must be above 0")
    return value
