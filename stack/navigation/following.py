"""Path following: the controller with the goal and progress checkers."""

from __future__ import annotations

from math import degrees, hypot, inf, pi

import numpy as np

from stack.components import ControlState, DriveState
from stack.errors import NavigationError
from stack.geometry.path_progress import PathProgress
from stack.lifecycle import Lifecycle, Timers
from stack.navigation.drive_tools import DriveTools
from stack.navigation.escape.unseen import unseen_walls
from stack.navigation.path_speeds import PathSpeeds, slower
from stack.navigation.people.standoff import Standoff
from stack.navigation.tasks import MotionExecutor, MotionTask
from stack.safety.monitor import moving_discs
from stack.types import (
    STANDSTILL,
    TRACK_PADDING,
    FailureCode,
    FloatArray,
    Image,
    Limitation,
    Path,
    Perceived,
    Pose2D,
    Twist,
    wrap_angle,
)
from stack.types.limitations import OBSTACLE, STOPPED

IDLE_BEFORE_REPLAN = 0.5
"""Seconds of standing before the goal after which a new plan is requested."""

BEHIND_BLIND = 0.5
"""Metres beyond its outline in which a robot minds the map's walls in its blind sectors."""


class Follower(Lifecycle):
    """Follows a path and detects when the robot has arrived, is stuck or is blocked.

    Args:
        tools: of the drive.
        tolerance: metres at the goal; None: that of the goal checker.
        task_timers: for the standoff, which lasts also while there is no path.

    Attributes:
        progress: progress on the current path; None before the first path.
        waiting: whether the controller stands in front of an obstacle.
        idle: runs while the robot stands before the goal.
        standoff: who is in the way.
        limitation: why it stands in this step although it wants to drive; None if it does not.
    """

    def __init__(self, tools: DriveTools, tolerance: float | None, task_timers: Timers) -> None:
        self._tools, self._tolerance = tools, tolerance
        self._last = STANDSTILL
        self._timers = Timers()
        self.idle, self._blocked = self._timers.new(), self._timers.new()
        self._obstructed, self._waited = self._timers.new(), self._timers.new()
        self.standoff = Standoff(task_timers, tools.landmarks)
        self.progress: PathProgress | None = None
        self._speeds: PathSpeeds | None = None
        self.waiting = False
        self.limitation: Limitation | None = None

    @property
    def at_position(self) -> bool:
        """Whether only the final heading is left."""
        return self._steers and self._tools.goal_checker.at_position

    def pause(self, now: float) -> None:
        """Hold the drive; does nothing while it is held."""
        self.limitation = None
        if self._timers.paused:
            return
        self._timers.pause(now)
        if self._steers:
            for part in self._tools.shared:
                part.pause(now)

    def resume(self, now: float) -> None:
        """Continue; does nothing unless held."""
        if not self._timers.paused:
            return
        self._timers.resume(now)
        if self._steers:
            for part in self._tools.shared:
                part.resume(now)
        elif self.progress is not None:  # another drive has used the controller
            self._steer(self.progress, now)

    def stop(self, now: float) -> None:
        self._tools.release(self, now)

    @property
    def _steers(self) -> bool:
        """Whether the controller follows the path of this drive."""
        return self._tools.steers(self)

    def _steer(self, progress: PathProgress, now: float) -> None:
        """Let the controller follow a path, and the checkers judge the drive on it."""
        tools = self._tools
        tools.steer(self, now)
        tools.goal_checker.set_goal(progress.path.goal, self._tolerance)
        tools.path_follower.follow(progress, tools.goal_checker.tolerance)

    def set_path(self, path: Path, now: float) -> None:
        """Set the path to follow."""
        self.resume(now)
        self.progress = self._tools.path_follower.progress_on(path)
        self._speeds = PathSpeeds(path, self._tools.robot.limits.linear_deceleration)
        self._steer(self.progress, now)
        self.idle.reset()

    def drop_path(self, now: float) -> None:
        """Follow nothing until there is another path."""
        self.stop(now)
        self.progress = self._speeds = None
        self.waiting = False

    def update(self, pose: Pose2D) -> None:
        """Update the progress on the path with the pose of this step, map frame."""
        if self.progress is not None:
            self.progress.advance(pose)

    @property
    def posted_limit(self) -> float:
        """Speed limit of the path at the robot's position, m/s; inf if none."""
        if self._speeds is None or self.progress is None:
            return inf
        return self._speeds.posted(self.progress.travelled)

    def off_heading(self, perceived: Perceived) -> str:
        """Describe the heading error of a car that stands at the goal's position; else empty."""
        stands = self.idles(perceived.time) and perceived.motion.twist.stands
        if self.can_turn or self.progress is None or not (stands and self.at_position):
            return ""
        goal, pose = self.progress.path.goal, perceived.estimate.pose
        off = abs(wrap_angle(goal.heading - pose.heading))
        return (
            f"{pose.distance_to(goal):.2f} m from the goal, but {degrees(off):.0f} deg off its "
            "heading, and this robot cannot turn in place"
        )

    @property
    def can_turn(self) -> bool:
        """Whether the robot can turn in place."""
        return self._tools.robot.drivetrain.turns_in_place

    def idles(self, now: float) -> bool:
        """Whether the robot has stood before the goal for IDLE_BEFORE_REPLAN seconds."""
        return self.idle.running and self.idle.elapsed(now) >= IDLE_BEFORE_REPLAN

    @property
    def ends_here(self) -> bool:
        """Whether the path ends within the goal tolerance, and does not only pass its end."""
        limit = self._tools.goal_checker.tolerance.position
        return self.progress is not None and self.progress.segment.ends_within(limit)

    def reached(self, perceived: Perceived) -> bool:
        """Whether the end of the path is reached; not while another drive uses the controller."""
        if self.progress is None or not self._steers:
            return False
        return self._tools.goal_checker.reached(self._drive_state(perceived, self.progress))

    def _drive_state(self, perceived: Perceived, progress: PathProgress) -> DriveState:
        still = self._last == STANDSTILL and perceived.motion.twist.stands
        top = min(self._tools.path_follower.top_speed, self.posted_limit)
        pose, left = perceived.estimate.pose, progress.remaining
        return DriveState(perceived.time, pose, still, left, progress.reversals, top)

    def step(self, perceived: Perceived) -> Twist:
        """Compute the velocity for this step.

        Raises:
            NavigationError: NO_PROGRESS, COLLISION_AHEAD for longer than collision_patience, or
                BLOCKED_BY_PERSON for longer than person_patience.
        """
        self.resume(perceived.time)
        if self.progress is None:
            return STANDSTILL
        self.standoff.update(perceived, self.progress, self._tools.parameters)
        if self.standoff.person is not None:
            self._tools.progress_checker.start(perceived.time)
        stuck = self._tools.progress_checker.stuck(self._drive_state(perceived, self.progress))
        if stuck:
            patience, now = self._tools.progress_checker.patience, perceived.time
            held = self._tools.held(now - patience, now) if patience else ""
            raise NavigationError(FailureCode.NO_PROGRESS, "; ".join(filter(None, (stuck, held))))
        self._last = self._command(perceived)
        if self._last != STANDSTILL:
            self.idle.reset()
        else:
            self.idle.start_once(perceived.time)
        return self._last

    def _command(self, perceived: Perceived) -> Twist:
        self.limitation = None
        if self._keeps_distance(perceived):
            self.limitation = self.standoff.limitation(perceived.estimate.pose)
            return STANDSTILL
        control_state = ControlState(
            perceived.time, perceived.estimate.pose, perceived.motion.twist,
            self._tools.local_costmap.grid, perceived.world.tracks,
            self._seen_and_mapped(perceived),
            blind_behind=perceived.obstacles.is_blind(pi),
            image=perceived.newest("camera", Image),
        )  # fmt: skip
        try:
            twist = self._tools.path_follower.step(control_state)
        except NavigationError as error:
            self._hold(error, perceived.time)
            self.limitation = self._limited_by(error, perceived)
            return STANDSTILL
        self.waiting = False
        self._blocked.reset()
        self._obstructed.reset()
        if twist != STANDSTILL:
            self._waited.reset()
        if self._speeds is None or self.progress is None:
            return twist
        return slower(twist, self._speeds.at(self.progress.travelled))

    def _limited_by(self, error: NavigationError, perceived: Perceived) -> Limitation:
        """Return why the controller has no command: the person in the way, or the nearest point."""
        person = self.standoff.limitation(perceived.estimate.pose)
        points = perceived.obstacles.points
        if person is not None or not len(points):
            return person or Limitation(STOPPED, OBSTACLE, error.failure.sentence)
        x, y = points[int(np.hypot(points[:, 0], points[:, 1]).argmin())]
        return Limitation(STOPPED, OBSTACLE, error.failure.sentence, (float(x), float(y)))

    def _seen_and_mapped(self, perceived: Perceived) -> FloatArray:
        """Return the obstacle points of the controller, and the map's walls in blind sectors."""
        points, tools = _points(perceived), self._tools
        ground, reach = (
            tools.global_costmap.ground,
            tools.robot.footprint.circumscribed_radius + BEHIND_BLIND,
        )
        walls = unseen_walls(ground, perceived.estimate.pose, perceived.obstacles, reach)
        return np.concatenate([points, walls]) if len(walls) else points

    def _keeps_distance(self, perceived: Perceived) -> bool:
        """Whether the robot stands before a person on its path, far enough away to turn."""
        tools, person, progress = self._tools, self.standoff.person, self.progress
        if person is None or progress is None:
            return False
        outline, keep = tools.robot.footprint, tools.parameters.person_clearance
        pose, (x, y) = perceived.estimate.pose, person.position
        path = progress.ahead(outline.circumscribed_radius + keep + 2.0 * person.radius)
        aside = float(np.hypot(path[:, 0] - x, path[:, 1] - y).min()) if len(path) else inf
        room = hypot(x - pose.x, y - pose.y) - person.radius - outline.circumscribed_radius
        holds = (
            room <= keep
            and aside <= person.radius + outline.inscribed_radius
            and not self.at_position
        )
        if holds:
            self._blocked.start_once(perceived.time)
            self.forget_obstacle()
            waited = self._blocked.elapsed(perceived.time)
            self.waiting = waited >= tools.parameters.replan_patience
        return holds

    def forget_obstacle(self) -> None:
        """Start over with an obstacle's patience: the robot waits for a person, or has moved."""
        self._obstructed.reset()
        self._waited.reset()

    def _hold(self, error: NavigationError, time: float) -> None:
        """Stand in front of an obstacle; raise the error when patience is over."""
        if error.failure.code != FailureCode.COLLISION_AHEAD:
            raise error
        p = self._tools.parameters
        self._blocked.start_once(time)
        self.waiting = self._blocked.elapsed(time) >= p.replan_patience
        if self.standoff.person is not None:
            self.forget_obstacle()
            return
        self._obstructed.start_once(time)
        obstructed = self._obstructed.elapsed(time)
        if obstructed < p.replan_patience:
            return
        self._waited.start_once(time)
        waited = self._waited.elapsed(time)
        if waited >= p.collision_patience:
            seconds = max(obstructed, waited)
            sentence = f"{error.failure.sentence}; waited {seconds:.1f} s for it to clear"
            raise NavigationError(FailureCode.COLLISION_AHEAD, sentence) from error


class Drive(MotionExecutor):
    """Base of drives along paths."""

    follows_map = True
    while_ambiguous = False

    def __init__(self, task: MotionTask, tools: DriveTools, tolerance: float | None) -> None:
        super().__init__(task)
        self._follower = Follower(tools, tolerance, self.timers)
        self._parts: list[Lifecycle] = [self._follower]

    @property
    def makes_way(self) -> bool:
        """Whether the robot leaves the way of a person whom it faces."""
        return False

    @property
    def limitation(self) -> Limitation | None:
        """Why it stands in this step although it wants to drive; None if it does not."""
        return self._follower.limitation

    def pause(self, now: float) -> None:
        super().pause(now)
        for part in self._parts:
            part.pause(now)

    def resume(self, now: float) -> None:
        super().resume(now)
        for part in self._parts:
            part.resume(now)

    def stop(self, now: float) -> None:
        for part in reversed(self._parts):
            part.stop(now)

    def note_evasion(self) -> None:
        """Note that an evasion is over: the robot may be beside its path."""


class PathDrive(Drive):
    """Follows a fixed path, without planning."""

    def __init__(self, task: MotionTask, tools: DriveTools, path: Path) -> None:
        super().__init__(task, tools, None)
        self.path, self.goal = path, path.goal
        task.path = path

    def start(self, now: float) -> None:
        self._follower.set_path(self.path, now)

    def step(self, perceived: Perceived) -> Twist:
        follower, task = self._follower, self.task
        try:
            if follower.progress is not None:
                follower.update(perceived.estimate.pose)
                task.report(drive_feedback(follower), follower.progress.remaining)
            if follower.ends_here and follower.reached(perceived):
                task.succeed("reached the end of the path")
                return STANDSTILL
            if off := follower.off_heading(perceived):
                raise NavigationError(FailureCode.NO_PROGRESS, off)
            return follower.step(perceived)
        except NavigationError as error:
            task.fail(error.failure.code, error.failure.sentence)
            return STANDSTILL


def _points(perceived: Perceived) -> FloatArray:
    """Return the obstacle points, base frame, without those of people left to evasion."""
    points = perceived.obstacles.points
    if not perceived.world.evaded:
        return points
    from stack.control.evasion.kernels import points_outside_discs  # imports numba

    discs = moving_discs(perceived.world.evaded, perceived.estimate.pose)
    left: FloatArray = points_outside_discs(np.ascontiguousarray(points), discs, inf, TRACK_PADDING)
    return left


def drive_feedback(follower: Follower) -> str:
    """Return the progress of a drive in a few words."""
    if follower.progress is None:
        return "planning"
    if follower.waiting and follower.standoff.person is not None:
        return f"waiting for a person in the way; {follower.progress.remaining:.1f} m to go"
    if follower.waiting:
        return f"waiting, an obstacle is in the way; {follower.progress.remaining:.1f} m to go"
    if follower.at_position:
        return "turning to the goal's heading" if follower.can_turn else "stopping at the goal"
    limit = follower.posted_limit
    slowly = f", {limit:.2f} m/s at most" if limit < inf else ""
    return f"{follower.progress.remaining:.1f} m to go{slowly}"
