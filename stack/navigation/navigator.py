"""Navigator: accepts motion tasks and computes the velocity of the newest one in each step."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import degrees

from stack.compilation import KernelTypes
from stack.components import GoalChecker, Planner, ProgressChecker
from stack.control.evasion.evasion import Evasion
from stack.control.path_follower import PathFollower
from stack.drivetrain.description import RobotDescription
from stack.errors import NavigationError, ParameterError
from stack.navigation.activities import Activities
from stack.navigation.disambiguation import Disambiguation
from stack.navigation.doubt import LocalisationMonitor
from stack.navigation.drive_to_goal import GoalDrive
from stack.navigation.drive_tools import DriveTools
from stack.navigation.escape.escape import Escape, EscapeGoal
from stack.navigation.escape.search import NO_FENCE
from stack.navigation.escape.surroundings import Surroundings
from stack.navigation.escape.unseen import zone_edges
from stack.navigation.following import PathDrive
from stack.navigation.motion_evasion import MotionEvasion
from stack.navigation.parameters import NavigationParameters
from stack.navigation.people.passing_place import Bodies
from stack.navigation.plans.planner_worker import PlannerWorker
from stack.navigation.plans.queries import PlanQueries
from stack.navigation.recoveries import (
    BackUp,
    DriveFor,
    DriveOnHeading,
    RecoveryTools,
    Spin,
    StraightLine,
)
from stack.navigation.tasks import CostmapLike, Emit, MotionExecutor, MotionTask, NavigationState
from stack.navigation.teleoperation import Teleoperation
from stack.safety.monitor import CollisionMonitor
from stack.types import (
    STANDSTILL,
    ContactZone,
    FailureCode,
    Path,
    Pose2D,
    TaskStatus,
    Twist,
)

MAKES_ROOM = 1.5
"""Metres that a drive may move away from an obstacle to turn onto its path."""

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
        self._robot, self._period, self._emit = robot, period, emit
        self._evasion = MotionEvasion(evasion, path_follower, emit)
        self._monitor = CollisionMonitor(robot)
        self._tools = DriveTools(
            path_follower, goal_checker, progress_checker,
            PlannerWorker(planner, log, is_real_time=is_real_time), parameters, local_costmap,
            global_costmap, emit,
            clear_of=robot.footprint.inscribed_radius,
            deceleration=robot.limits.linear_deceleration,
            back_up=self._backing,
            make_room=self._making_room,
            is_round=robot.footprint.is_round,
            turns_in_place=robot.drivetrain.turns_in_place,
            bodies=Bodies(
                robot.footprint.inscribed_radius, robot.footprint.circumscribed_radius
            ),
            counters={"plans": 0.0, "replans": 0.0, "recoveries": 0.0, "distance": 0.0},
        )  # fmt: skip
        self._surroundings = Surroundings()
        self.localisation_monitor = LocalisationMonitor(emit, period)
        self._activities = Activities(emit, self.localisation_monitor, log)
        self._queries = PlanQueries(self._tools)
        self._state: NavigationState | None = None

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
        current = self._activities.current
        return current.drive or current if isinstance(current, Disambiguation) else current

    @property
    def counters(self) -> dict[str, float]:
        """Counters for the snapshot: plans, replans, recoveries, distance (metres driven)."""
        return dict(self._tools.counters)

    def step(self, state: NavigationState) -> Twist:
        """Compute the velocity for this step; STANDSTILL without a running task."""
        self._count_distance(state)
        self._state = state
        self._surroundings.look(state)
        self._queries.step(state)
        self.localisation_monitor.update(state, self.parameters)
        wanted, motion = self._activities.step(state, self.parameters), self._motion
        limit = self.localisation_monitor.speed_limit
        return self._evasion.step(
            wanted, state, motion, along_path=_follows_path(motion), limit=limit
        )

    def await_plans(self, now: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for the plans that the step at a time needs.

        Returns:
            Whether they are there: `step` does not wait.
        """
        return self._tools.planner_worker.await_plans(now, longest)

    def pause(self, now: float) -> None:
        """Hold the mission's motion at a time in seconds; does nothing while it is held."""
        self._activities.pause(now)

    def resume(self, now: float) -> None:
        """Continue the mission's motion, and cancel a detour; does nothing unless held."""
        self._activities.resume(now)

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
        task = self._task(f"drive to {_text(goals[-1])}")
        drive = GoalDrive(task, self._tools, goals, tolerance)
        drive.partial = partial
        vias = f" via {len(goals) - 1} poses" if len(goals) > 1 else ""
        self.start(first(drive), "goal", f"goal {_text(goals[-1])} accepted{vias}")
        return task

    def view_drive(self, view: Pose2D) -> GoalDrive:
        """Return the drive to a place where rival poses differ, map frame of the estimate."""
        task = MotionTask(f"drive to {_text(view)}", lambda _: None)
        drive = GoalDrive(task, self._tools, [view], self.parameters.view_tolerance)
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
        task = self._task(f"follow a path of {path.length:.1f} m")
        self.start(
            PathDrive(task, self._tools, path), "goal", f"path of {path.length:.1f} m accepted"
        )
        return task

    def plan(self, goal: Pose2D, start: Pose2D | None = None) -> MotionTask:
        """Plan without driving; the result is the task's `path`."""
        task = self._task(f"plan to {_text(goal)}", moves=False)
        self._queries.begin(task, goal, start)
        return task

    def spin(
        self, angle: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        """Turn in place by an angle, positive to the left; a car fails at once."""
        task = self._task(f"spin {degrees(angle):.0f} deg")
        rate = _positive("speed", self.parameters.spin_speed if speed is None else speed)
        refusal = Spin.unsupported_reason(self._robot)
        if refusal:
            task.fail(FailureCode.UNSUPPORTED, refusal)
            return task
        return self._recover(Spin(task, angle, rate, self._recovery_tools()), while_lost)

    def back_up(
        self, distance: float, *, speed: float | None = None, while_lost: bool = False
    ) -> MotionTask:
        """Drive straight back by a distance.

        Raises:
            ParameterError: a distance or speed that is not above 0, or a robot that cannot reverse.
        """
        _positive("distance", distance)
        _positive("reverse_speed", self._robot.limits.reverse_speed)
        task = self._task(f"back up {distance:.2f} m")
        rate = _positive("speed", self.parameters.back_up_speed if speed is None else speed)
        return self._recover(BackUp(task, distance, rate, self._recovery_tools()), while_lost)

    def drive_on_heading(
        self, distance: float, *, speed: float | None = None, direction: float = 0.0,
        while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive straight by a distance (negative: backward) and hold the heading by odometry.

        Args:
            distance: metres.
            speed: m/s, within the limits of the drive.
            direction: radians in the base frame, omnidirectional robots only; others fail at once.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a speed that is not above 0.
        """
        rate = _positive("speed", self.parameters.straight_speed if speed is None else speed)
        line = StraightLine(distance, direction, rate)
        task = self._task(f"drive {distance:.2f} m on its heading")
        refusal = line.unsupported_reason(self._robot)
        if refusal:
            task.fail(FailureCode.UNSUPPORTED, refusal)
            return task
        return self._recover(DriveOnHeading(task, line, self._recovery_tools()), while_lost)

    def escape(
        self, *, clearance: float | None = None, distance: float = 1.5,
        speed: float | None = None, while_lost: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive out of a tight spot by range sensors and odometry alone.

        Sensors do not see keep-out zones. A robot that knows where it is stays out of them, and
        drives out of one in which it stands on the map.

        Args:
            clearance: desired metres around the outline; None: room to turn, at least 15 cm.
            distance: maximum metres to drive.
            speed: m/s.
            while_lost: drive also while the robot is lost.

        Raises:
            ParameterError: a value that is not above 0.
        """
        room = self._room_to_turn
        escape_goal = EscapeGoal(
            _positive("clearance", room if clearance is None else clearance),
            _positive("distance", distance),
            _positive("speed", self.parameters.escape_speed if speed is None else speed),
        )
        task = self._task("escape to free space")
        way_out, state = self._tools.global_costmap.way_out, self._state
        lost = state is None or self.localisation_monitor.refuses(self.parameters)
        if way_out is not None and not lost:
            return self._recover(GoalDrive(task, self._tools, [way_out], None), while_lost)
        return self._recover(self._escape(task, escape_goal, lost=lost), while_lost)

    def _escape(self, task: MotionTask, goal: EscapeGoal, *, lost: bool) -> Escape:
        """Return an escape that keeps out of keep-out zones, as far as the robot knows of them."""
        fence, state, costmap = NO_FENCE, self._state, self._tools.global_costmap
        if state is not None and costmap.way_out is None and not lost:
            reach = goal.distance + 2.0 * self._robot.footprint.circumscribed_radius
            pose, zones = state.estimate.pose, costmap.forbidden.values()
            fence = state.odometry.pose.transform(zone_edges(zones, costmap.view, pose, reach))
        return Escape(task, goal, self._surroundings, self._recovery_tools(), fence)

    @property
    def contact_zone(self) -> ContactZone | None:
        """Where the robot may touch something in its current motion."""
        current = self._activities.current
        return current.contact if isinstance(current, DriveFor) else None

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> MotionTask:  # fmt: skip
        """Drive a velocity for some seconds; a call during this time renews it.

        Raises:
            NavigationError: LOST, if the robot is, and is not to be driven then or stopped.
        """
        monitor, state, current = self.localisation_monitor, self._state, self._activities.current
        moves = twist != STANDSTILL and not while_lost and self.parameters.lost_motions == "refuse"
        if moves and state is not None and monitor.refuses(self.parameters):
            raise NavigationError(FailureCode.LOST, monitor.refusal(state.estimate))
        now = 0.0 if state is None else state.time
        if isinstance(current, DriveFor):
            current.renew(twist, now, seconds, contact)
        else:
            current = DriveFor(self._task("drive on command"), twist, now, seconds)
            current.contact = contact
            self.start(current, "goal", "driving on command")
        current.while_lost = while_lost or twist == STANDSTILL
        current.gives_way = gives_way
        return current.task

    def assisted_teleop(self, seconds: float, *, silence: float = 30.0) -> MotionTask:
        """Let the operator drive, through `teleoperation`.

        Args:
            seconds: maximum duration.
            silence: seconds without a velocity command after which the task fails.
        """
        task = self._task("assisted teleoperation")
        timeout = self.parameters.teleop_timeout
        return self._recover(Teleoperation(task, seconds, silence, timeout), while_lost=True)

    @property
    def teleoperation(self) -> Teleoperation | None:
        """The running teleoperation task, None without one; accepts the operator's velocities."""
        current = self._activities.current
        return current if isinstance(current, Teleoperation) else None

    def start(self, executor: MotionExecutor, kind: str, text: str) -> None:
        """Run an executor from the next step on; cancels the current one."""
        self._activities.begin(executor)
        self._emit(kind, text)

    def new_task(self, what: str) -> MotionTask:
        """Create a task handle for an executor built elsewhere."""
        return self._task(what)

    def cancel_all(self, why: str = "cancelled") -> None:
        """Cancel every task; the robot stops from the next step on."""
        self._queries.cancel(why)
        self._activities.cancel(why)

    def stop_ended(self, now: float) -> None:
        """Stop the motions whose task has ended, as the next step would.

        Args:
            now: seconds.
        """
        self._activities.stop_ended(now)

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
        shown = self._activities.shown
        if isinstance(shown, Disambiguation):
            shown = shown.drive
        return shown if isinstance(shown, GoalDrive | PathDrive) else None

    def _backing(self, distance: float) -> MotionExecutor | None:
        """Return a motion straight back as part of a drive; None if the robot cannot reverse."""
        if not self._robot.limits.reverse_speed:
            return None
        task = MotionTask(f"back up {distance:.2f} m", lambda _: None)
        return BackUp(task, distance, self.parameters.back_up_speed, self._recovery_tools())

    @property
    def _room_to_turn(self) -> float:
        """Clearance around the outline with room to turn, at least 15 cm, metres."""
        outline = self._robot.footprint
        return max(0.15, outline.circumscribed_radius - outline.inscribed_radius + 0.05)

    def _making_room(self) -> MotionExecutor:
        """Return a motion to where the robot can turn, as part of a drive."""
        task = MotionTask("make room to turn", lambda _: None)
        escape_goal = EscapeGoal(self._room_to_turn, MAKES_ROOM, self.parameters.escape_speed)
        return self._escape(task, escape_goal, lost=False)

    def _recovery_tools(self) -> RecoveryTools:
        return RecoveryTools(self._robot, self.parameters, self._monitor, self._period)

    def _recover(self, executor: MotionExecutor, while_lost: bool) -> MotionTask:
        executor.while_lost = while_lost
        self._tools.count("recoveries")
        self.start(executor, "recovery", executor.task.what)
        return executor.task

    def _task(self, what: str, *, moves: bool = True) -> MotionTask:
        return MotionTask(what, lambda task: self._ended(task, moves))

    def _ended(self, task: MotionTask, moves: bool) -> None:
        failure, status = task.failure, task.status
        level = "warning" if status is TaskStatus.FAILED else "info"
        word = status.name.lower()
        why = f": {task.feedback}" if task.feedback else ""
        code = "" if failure is None else str(failure.code)
        text = f"{task.what} {word}{why}"
        self._emit("task", text, level, status=word, code=code, moves=moves)

    def _count_distance(self, state: NavigationState) -> None:
        if self._state is not None:
            before, now = self._state.odometry.pose, state.odometry.pose
            self._tools.counters["distance"] += before.distance_to(now)


def _follows_path(motion: MotionExecutor | None) -> bool:
    return isinstance(motion, GoalDrive | PathDrive) and motion.path is not None


def _text(pose: Pose2D) -> str:
    return f"({pose.x:.2f}, {pose.y:.2f}, {degrees(pose.heading):.0f} deg)"


def _positive(name: str, value: float) -> float:
    if not value > 0.0:
        raise ParameterError(name, f"{value:g} must be above 0")
    return value
