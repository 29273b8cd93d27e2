"""Navigator: accepts motion tasks and computes the velocity of the newest one in each step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import degrees
from typing import NamedTuple

from stack.compilation import KernelTypes
from stack.components import GoalChecker, Planner, ProgressChecker
from stack.control.evasion.evasion import Evasion
from stack.control.path_follower import PathFollower
from stack.drivetrain.description import RobotDescription
from stack.errors import ParameterError
from stack.navigation.activities import Activities
from stack.navigation.disambiguation import Disambiguation
from stack.navigation.doubt import LocalisationMonitor
from stack.navigation.drive_to_goal import GoalDrive
from stack.navigation.drive_tools import DriveTools
from stack.navigation.following import PathDrive
from stack.navigation.motion_evasion import MotionEvasion
from stack.navigation.parameters import NavigationParameters
from stack.navigation.people.passing_place import Bodies
from stack.navigation.plans.planner_worker import PlannerWorker
from stack.navigation.plans.queries import PlanQueries
from stack.navigation.reactive_motions import ReactiveMotions
from stack.navigation.recoveries import (
    DriveFor,
)
from stack.navigation.recovery_tasks import RecoveryTasks
from stack.navigation.tasks import CostmapLike, Emit, MotionExecutor, MotionTask
from stack.types import (
    ContactZone,
    Path,
    Perceived,
    Pose2D,
    Twist,
)

VIEW_TOLERANCE = 0.3
"""Goal tolerance at a place from which rival poses look different, m."""


class WantedTwist(NamedTuple):
    """What navigation wants: a velocity, base frame, and where the robot may touch something."""

    twist: Twist
    contact: ContactZone | None = None


First = Callable[[GoalDrive], MotionExecutor]


def _at_once(drive: GoalDrive) -> MotionExecutor:
    return drive


class Navigator:
    """Plans, follows paths and recovers; one motion task at a time, a newer one cancels the older.

    Called once per control step. Between `pause` and `resume` the mission's motion is held: no
    time limit counts, and a motion that is begun meanwhile is a detour of the operator.

    Args:
        robot: outline and limits.
        planner: global planner.
        path_follower: with the controller.
        goal_checker: decides when a drive has reached its goal.
        progress_checker: decides when a drive makes no progress.
        parameters: patience, planning and recoveries.
        evasion: leaves the way of people who walk towards the robot.
        local_costmap: around the robot, for the controller.
        global_costmap: for planning.
        emit: called with (kind, text, level="info", **fields) for each event.
        period: seconds between control steps.
        log: receives the tracebacks of planners and controllers.

    Attributes:
        localisation_monitor: decides what moves while the robot is lost.
        activities: the motions under way.
        recoveries: begins recoveries.
    """

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels of the navigator's own parts."""
        from stack.geometry.kernels import PATHS
        from stack.mapping.exploration.kernels import TRAVEL
        from stack.navigation.escape.kernels import ESCAPE

        return (*PATHS, *ESCAPE, *TRAVEL)

    def __init__(  # noqa: PLR0913 - called once, by the composition root
        self, robot: RobotDescription, planner: Planner, path_follower: PathFollower,
        goal_checker: GoalChecker, progress_checker: ProgressChecker,
        parameters: NavigationParameters, evasion: Evasion, local_costmap: CostmapLike,
        global_costmap: CostmapLike, emit: Emit, period: float,
        log: Callable[[str], None] = lambda _: None, *, is_real_time: bool = False,
    ) -> None:  # fmt: skip
        self._emit = emit
        self._evasion = MotionEvasion(evasion, path_follower, emit)
        self._tools = DriveTools(
            path_follower, goal_checker, progress_checker,
            PlannerWorker(planner, log, is_real_time=is_real_time), parameters, local_costmap,
            global_costmap, emit,
            clear_of=robot.footprint.inscribed_radius,
            deceleration=robot.limits.linear_deceleration,
            motions=ReactiveMotions(robot, global_costmap, period),
            is_round=robot.footprint.is_round,
            turns_in_place=robot.drivetrain.turns_in_place,
            bodies=Bodies(
                robot.footprint.inscribed_radius, robot.footprint.circumscribed_radius
            ),
            counters={"plans": 0.0, "replans": 0.0, "recoveries": 0.0, "distance": 0.0},
        )  # fmt: skip
        self.localisation_monitor = LocalisationMonitor(emit, period)
        self.activities = Activities(emit, self.localisation_monitor, log)
        self.recoveries = RecoveryTasks(
            robot, self._tools, self.activities, self.localisation_monitor
        )
        self._queries = PlanQueries(self._tools)
        self._state: Perceived | None = None

    @property
    def parameters(self) -> NavigationParameters:
        """Current parameters; new tolerances apply to tasks started later."""
        return self._tools.parameters

    def configure(self, parameters: NavigationParameters) -> None:
        """Apply new parameters, from the next step on."""
        self._tools.parameters = parameters

    @property
    def planner(self) -> Planner:
        """Current planner; may be replaced between steps."""
        return self._tools.planner_worker.planner

    @planner.setter
    def planner(self, planner: Planner) -> None:
        self._tools.planner_worker.planner = planner

    def set_edge(self, edge: str, *, closed: bool) -> None:
        """Close or open an edge of the route graph; the current drive replans.

        Raises:
            ParameterError: there is no such edge, or the planner has no route graph.
        """
        self.planner = self.planner.with_edge(edge, closed=closed)
        self._emit("route", f"edge {edge} is now {'closed' if closed else 'open'}", edge=edge)

    @property
    def path_follower(self) -> PathFollower:
        """The follower with the controller."""
        return self._tools.path_follower

    @property
    def goal_checker(self) -> GoalChecker:
        """Decides when a drive has reached its goal."""
        return self._tools.goal_checker

    @property
    def progress_checker(self) -> ProgressChecker:
        """Decides when a drive makes no progress."""
        return self._tools.progress_checker

    @property
    def evasion(self) -> Evasion:
        """Leaves the way of people who walk towards the robot."""
        return self._evasion.evasion

    @property
    def evades(self) -> bool:
        """Whether only evasion keeps the robot clear of who walks.

        Otherwise they are obstacles: evasion is off, or the controller plans with tracks itself.
        """
        on = self.evasion.parameters.when != "never"
        return on and not self.path_follower.plans_with_tracks

    @property
    def goal(self) -> Pose2D | None:
        """Goal of the current drive, map frame; None without one."""
        drive = self._drive
        return None if drive is None else drive.goal

    @property
    def path(self) -> Path | None:
        """Current path, map frame."""
        drive = self._drive
        return None if drive is None else drive.path

    @property
    def local_plan(self) -> Path | None:
        """Planned motion of the controller, map frame."""
        follows = _follows_path(self._motion)
        return self._tools.path_follower.local_plan if follows else None

    @property
    def _motion(self) -> MotionExecutor | None:
        """The motion under way: a drive also if one pose had to be found first."""
        current = self.activities.current
        return current.drive or current if isinstance(current, Disambiguation) else current

    @property
    def counters(self) -> dict[str, float]:
        """Counters for the snapshot: plans, replans, recoveries, distance (metres driven)."""
        return dict(self._tools.counters)

    def step(self, state: Perceived) -> WantedTwist:
        """Compute the velocity for this step; STANDSTILL without a running task."""
        self._count_distance(state)
        self._state = state
        self.recoveries.look(state)
        self._queries.step(state)
        self.localisation_monitor.update(state, self.parameters)
        wanted, motion = self.activities.step(state, self.parameters), self._motion
        limit = self.localisation_monitor.speed_limit
        twist = self._evasion.step(
            wanted, state, motion, along_path=_follows_path(motion), limit=limit
        )
        current = self.activities.current
        return WantedTwist(twist, current.contact if isinstance(current, DriveFor) else None)

    def await_plans(self, now: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for the plans that the step at a time needs.

        Returns:
            Whether they are there: `step` does not wait.
        """
        return self._tools.planner_worker.await_plans(now, longest)

    def pause(self, now: float) -> None:
        """Hold the mission's motion at a time in seconds; does nothing while it is held."""
        self.activities.pause(now)

    def resume(self, now: float) -> None:
        """Continue the mission's motion, and cancel a detour; does nothing unless held."""
        self.activities.resume(now)

    def navigate_to(
        self, goal: Pose2D, *, tolerance: float | None = None, partial: bool = False,
        first: First = _at_once,
    ) -> MotionTask:  # fmt: skip
        """Plan and drive to a pose in the map frame, replanning as the world changes.

        Args:
            goal: map frame.
            tolerance: metres; None: that of the goal checker.
            partial: reaching the nearest reachable pose counts as success.
            first: returns the motion that begins the task, given its drive.
        """
        return self._drive_through([goal], tolerance, partial, first)

    def navigate_through(
        self, goals: Sequence[Pose2D], *, tolerance: float | None = None, first: First = _at_once
    ) -> MotionTask:
        """Drive through poses in turn to the last one, without stopping in between.

        Raises:
            ParameterError: no goals.
        """
        if not goals:
            raise ParameterError("goals", "expected at least one pose, got an empty list")
        return self._drive_through(goals, tolerance, False, first)

    def _drive_through(
        self, goals: Sequence[Pose2D], tolerance: float | None, partial: bool, first: First
    ) -> MotionTask:
        task = self.activities.task(f"drive to {_text(goals[-1])}")
        drive = GoalDrive(task, self._tools, goals, tolerance)
        drive.partial = partial
        vias = f" via {len(goals) - 1} poses" if len(goals) > 1 else ""
        self.activities.start(first(drive), "goal", f"goal {_text(goals[-1])} accepted{vias}")
        return task

    def view_drive(self, view: Pose2D) -> GoalDrive:
        """Return the drive to a place where rival poses differ, map frame of the estimate."""
        task = MotionTask(f"drive to {_text(view)}", lambda _: None)
        drive = GoalDrive(task, self._tools, [view], VIEW_TOLERANCE)
        drive.while_ambiguous = drive.partial = True
        self._emit("view", f"driving to {_text(view)}, where the possible poses differ")
        return drive

    def follow_path(self, path: Path) -> MotionTask:
        """Follow a fixed path, without replanning.

        Raises:
            ParameterError: the path has fewer than two points.
        """
        if len(path.points) < 2:
            raise ParameterError("path", f"expected at least 2 points, got {len(path.points)}")
        task = self.activities.task(f"follow a path of {path.length:.1f} m")
        self.activities.start(
            PathDrive(task, self._tools, path), "goal", f"path of {path.length:.1f} m accepted"
        )
        return task

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> MotionTask:
        """Plan without driving; the result is the task's `path`."""
        task = self.activities.task(f"plan to {_text(goal)}", moves=False)
        self._queries.begin(task, goal, start)
        return task

    def cancel_all(self, why: str = "cancelled") -> None:
        """Cancel every task; the robot stops from the next step on."""
        self._queries.cancel(why)
        self.activities.cancel(why)

    def stop_ended(self, now: float) -> None:
        """Stop the motions whose task has ended, as the next step would.

        Args:
            now: seconds.
        """
        self.activities.stop_ended(now)

    def close(self, now: float | None = None) -> None:
        """Cancel all tasks, stop their motions and the planner's thread.

        Args:
            now: seconds; None: the time of the last step.
        """
        self.cancel_all("the run is over")
        last = 0.0 if self._state is None else self._state.time
        self.stop_ended(last if now is None else now)
        self._tools.planner_worker.close()

    @property
    def _drive(self) -> GoalDrive | PathDrive | None:
        shown = self.activities.shown
        if isinstance(shown, Disambiguation):
            shown = shown.drive
        return shown if isinstance(shown, GoalDrive | PathDrive) else None

    def _count_distance(self, state: Perceived) -> None:
        if self._state is not None:
            before, now = self._state.motion.pose, state.motion.pose
            self._tools.counters["distance"] += before.distance_to(now)


def _follows_path(motion: MotionExecutor | None) -> bool:
    return isinstance(motion, GoalDrive | PathDrive) and motion.path is not None


def _text(pose: Pose2D) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f}, {degrees(pose.heading):.0f} deg)"
