"""Path following: the controller with goal, progress and localisation checks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import degrees, hypot, inf

from stack.components import Controller, ControlState
from stack.control.checkers import GoalChecker, LostChecker, ProgressChecker
from stack.control.cusp_splitter import cusps_of
from stack.control.path_progress import PathProgress
from stack.errors import NavigationError
from stack.lifecycle import Timers
from stack.navigation.parameters import NavigationParameters
from stack.navigation.path_speeds import PathSpeeds, slower
from stack.navigation.planner_worker import PlannerWorker
from stack.navigation.tasks import CostmapLike, Emit, MotionExecutor, MotionTask, NavigationState
from stack.types import STANDSTILL, FailureCode, Path, Twist, wrap_angle

STANDING_SPEED, STANDING_TURN = 0.02, 0.05
"""Speeds in m/s and rad/s below which the robot counts as standing."""

IDLE_BEFORE_REPLAN = 0.5
"""Seconds of standing before the goal after which a new plan is requested."""


@dataclass
class Tools:
    """Components used by drives; parameters and controller may be replaced between steps.

    Attributes:
        clear_of: radius around the robot, metres, in which a blocked path is ignored.
        deceleration: of the robot, m/s², for braking before a path's speed limit.
        turns_in_place: whether the robot can turn in place; a car cannot.
        has_legs: whether paths have forward and backward segments; not for omnidirectional robots.
        counters: plans, replans, recoveries and distance, for the snapshot.
        steered_by: the drive whose path the controller follows.
    """

    controller: Controller
    planner_worker: PlannerWorker
    parameters: NavigationParameters
    local_costmap: CostmapLike
    global_costmap: CostmapLike
    emit: Emit
    clear_of: float
    deceleration: float = 1.0
    turns_in_place: bool = True
    has_legs: bool = True
    counters: dict[str, float] = field(default_factory=dict)
    steered_by: object = None

    def count(self, what: str) -> None:
        """Increment a counter."""
        self.counters[what] = self.counters.get(what, 0.0) + 1.0


def standing(twist: Twist) -> bool:
    """Whether a measured velocity counts as standstill."""
    speed = hypot(twist.linear, twist.lateral)
    return speed < STANDING_SPEED and abs(twist.angular) < STANDING_TURN


class Follower:
    """Follows a path and detects when the robot has arrived, is stuck or is blocked.

    Attributes:
        progress: progress on the current path; None before the first path.
        path: the path to follow; None before the first path.
        waiting: whether the controller stands in front of an obstacle.
        idle: runs while the robot stands before the goal.
    """

    def __init__(self, tools: Tools, tolerance: float | None) -> None:
        p = tools.parameters
        self._tools = tools
        self._tolerance = p.goal_position if tolerance is None else tolerance
        self._progress_checker = ProgressChecker(
            p.progress_distance, p.progress_angle, p.progress_time
        )
        self._goal: GoalChecker | None = None
        self._last = STANDSTILL
        self._timers = Timers()
        self.idle, self._blocked = self._timers.new(), self._timers.new()
        self.path: Path | None = None
        self.progress: PathProgress | None = None
        self._speeds: PathSpeeds | None = None
        self.waiting = False

    @property
    def at_position(self) -> bool:
        """Whether only the final heading is left."""
        return self._goal is not None and self._goal.at_position

    def pause(self, now: float) -> None:
        """Hold the drive; does nothing while it is held."""
        if self._timers.paused:
            return
        for timers in self._all_timers():
            timers.pause(now)
        if self._tools.steered_by is self:
            self._tools.controller.pause(now)

    def resume(self, now: float) -> None:
        """Continue; does nothing unless held."""
        if not self._timers.paused:
            return
        for timers in self._all_timers():
            timers.resume(now)
        if self._tools.steered_by is self:
            self._tools.controller.resume(now)
        elif self.path is not None:  # another drive has used the controller
            self._steer(self.path, now)

    def stop(self, now: float) -> None:
        """End the drive."""
        if self._tools.steered_by is self:
            self._tools.controller.stop(now)
            self._tools.steered_by = None

    def _all_timers(self) -> Iterator[Timers]:
        yield self._timers
        yield self._progress_checker.timers
        if self._goal is not None:
            yield self._goal.timers

    def _steer(self, path: Path, now: float) -> None:
        """Give a path to the controller."""
        if self._tools.steered_by is not self:
            self._tools.controller.start(now)
            self._tools.steered_by = self
        self._tools.controller.set_path(path)

    def set_path(self, path: Path, now: float) -> None:
        """Set the path to follow."""
        self.resume(now)
        p, self.path = self._tools.parameters, path
        self.progress = PathProgress(path, cusps_of(path) if self._tools.has_legs else ())
        self._speeds = PathSpeeds(path, self._tools.deceleration)
        self._goal = GoalChecker(path.goal, self._tolerance, p.goal_heading, p.goal_settle)
        self._steer(path, now)
        self.idle.reset()

    @property
    def posted_limit(self) -> float:
        """Speed limit of the path at the robot's position, m/s; inf if none."""
        if self._speeds is None or self.progress is None:
            return inf
        return self._speeds.posted(self.progress.travelled)

    def off_heading(self, state: NavigationState) -> str:
        """Describe the heading error of a car that stands at the goal's position; else empty."""
        stands = self.idles(state.time)
        if self._tools.turns_in_place or self._goal is None or not (stands and self.at_position):
            return ""
        goal, pose = self._goal.goal, state.estimate.pose
        off = abs(wrap_angle(goal.heading - pose.heading))
        if off <= self._tools.parameters.goal_heading:
            return ""
        return (
            f"{pose.distance_to(goal):.2f} m from the goal, but {degrees(off):.0f} deg off its "
            "heading, and this robot cannot turn in place"
        )

    def idles(self, now: float) -> bool:
        """Whether the robot has stood before the goal for IDLE_BEFORE_REPLAN seconds."""
        return self.idle.running and self.idle.elapsed(now) >= IDLE_BEFORE_REPLAN

    def reached(self, state: NavigationState) -> bool:
        """Whether the end of the path is reached."""
        if self._goal is None:
            return False
        still = self._last == STANDSTILL and standing(state.odometry.twist)
        return self._goal.reached(state.time, state.estimate.pose, standing=still)

    def step(self, state: NavigationState) -> Twist:
        """Compute the velocity for this step.

        Raises:
            NavigationError: NO_PROGRESS, or COLLISION_AHEAD for longer than collision_patience.
        """
        self.resume(state.time)
        p = self._tools.parameters
        if self._progress_checker.stuck(state.time, state.estimate.pose):
            raise NavigationError(
                FailureCode.NO_PROGRESS,
                f"moved less than {p.progress_distance:g} m in {p.progress_time:g} s",
            )
        self._last = self._command(state)
        if self._last != STANDSTILL:
            self.idle.reset()
        else:
            self.idle.start_once(state.time)
        return self._last

    def _command(self, state: NavigationState) -> Twist:
        control_state = ControlState(
            state.time, state.estimate.pose, state.odometry.twist, self._tools.local_costmap.grid,
            state.tracks,
            state.obstacles.points,
        )  # fmt: skip
        try:
            twist = self._tools.controller.command(control_state)
        except NavigationError as error:
            self._hold(error, state.time)
            return STANDSTILL
        self.waiting = False
        if twist != STANDSTILL:
            self._blocked.reset()
        if self._speeds is None or self.progress is None:
            return twist
        return slower(twist, self._speeds.at(self.progress.travelled))

    def _hold(self, error: NavigationError, time: float) -> None:
        """Stand in front of an obstacle; raise the error when patience is over."""
        if error.failure.code != FailureCode.COLLISION_AHEAD:
            raise error
        self.waiting = True
        self._blocked.start_once(time)
        if self._blocked.elapsed(time) >= self._tools.parameters.collision_patience:
            raise error


class PathDrive(MotionExecutor):
    """Follows a fixed path, without planning."""

    def __init__(self, task: MotionTask, tools: Tools, path: Path) -> None:
        super().__init__(task)
        self.path, self.goal = path, path.goal
        self._follower = Follower(tools, None)
        self._lost = LostChecker(tools.parameters.lost_health, tools.parameters.lost_time)
        task.path = path

    def start(self, now: float) -> None:
        """Give the path to the controller."""
        self._follower.set_path(self.path, now)

    def pause(self, now: float) -> None:
        """Hold the drive."""
        super().pause(now)
        self._lost.timers.pause(now)
        self._follower.pause(now)

    def resume(self, now: float) -> None:
        """Continue from where the robot stands."""
        super().resume(now)
        self._lost.timers.resume(now)
        self._follower.resume(now)

    def stop(self, now: float) -> None:
        """Release the controller."""
        self._follower.stop(now)

    def step(self, state: NavigationState) -> Twist:
        """Compute the velocity for this step."""
        follower, task = self._follower, self.task
        try:
            check_not_lost(self._lost, state)
            if self._lost.doubted:
                follower.pause(state.time)
                return STANDSTILL
            if follower.progress is not None:
                follower.progress.advance(state.estimate.pose)
                task.report(drive_feedback(follower), follower.progress.remaining)
            if follower.reached(state):
                task.succeed("reached the end of the path")
                return STANDSTILL
            if off := follower.off_heading(state):
                raise NavigationError(FailureCode.NO_PROGRESS, off)
            return follower.step(state)
        except NavigationError as error:
            task.fail(error.failure.code, error.failure.sentence)
            return STANDSTILL


def check_not_lost(checker: LostChecker, state: NavigationState) -> None:
    """Raise NavigationError LOST when the localisation health has been low for too long."""
    health = state.estimate.health
    if checker.lost(state.time, health):
        raise NavigationError(
            FailureCode.LOST,
            f"localisation health {health:.2f}, below {checker.health:g} for "
            f"{checker.seconds:g} s: the scans do not fit the map here",
        )


def drive_feedback(follower: Follower) -> str:
    """Return the progress of a drive in a few words."""
    if follower.progress is None:
        return "planning"
    if follower.waiting:
        return f"waiting, an obstacle is in the way; {follower.progress.remaining:.1f} m to go"
    if follower.at_position:
        return "turning to the goal's heading"
    limit = follower.posted_limit
    slowly = f", {limit:.2f} m/s at most" if limit < inf else ""
    return f"{follower.progress.remaining:.1f} m to go{slowly}"
