"""Base class of behaviours that follow something, and whether the robot moves meanwhile."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

from py_trees.common import Status

from behaviours._motion.driving import DrivingBehaviour
from behaviours._motion.odometry_trail import OdometryTrail
from behaviours.base import port
from behaviours.timer import Timer
from stack.types import FailureCode, Pose2D

STUCK_TIME, STUCK_DISTANCE = 10.0, 0.15


class StuckWatch:
    """Whether the robot has stayed within STUCK_DISTANCE for STUCK_TIME.

    Args:
        timer: started.
        odometry: pose now, odom frame.
    """

    def __init__(self, timer: Timer, odometry: Pose2D) -> None:
        self._timer, self._rest = timer, odometry

    def is_stuck(self, odometry: Pose2D) -> bool:
        """Return whether it is stuck, given its pose now, odom frame."""
        if odometry.distance_to(self._rest) > STUCK_DISTANCE:
            self._rest = odometry
            self._timer.restart()
        return self._timer.is_over(STUCK_TIME)


@dataclass(frozen=True, slots=True)
class FollowStart:
    """Where a behaviour began to follow; its `until_…` ports count from there.

    Attributes:
        timer: started then.
        travelled: distance driven until then, metres.
        pose: map frame.
    """

    timer: Timer
    travelled: float
    pose: Pose2D


@dataclass(slots=True)
class RootMeanSquare:
    """Of the errors added so far; 0 without any."""

    count: int = 0
    squares: float = 0.0

    def add(self, error: float) -> None:
        self.count += 1
        self.squares += error**2

    @property
    def value(self) -> float:
        return sqrt(self.squares / self.count) if self.count else 0.0


class FollowingBehaviour(DrivingBehaviour):
    """Base class of behaviours that follow something until the first `until_…` is reached."""

    until_travelled: float | None = port(
        "end after this distance", unit="m", default=None, above=0.0
    )
    until_time: float | None = port("end after this time", unit="s", default=None, above=0.0)
    until_place: Pose2D | None = port("end near this place, map frame", default=None)
    place_radius: float = port("radius around `until_place`", unit="m", default=0.5, above=0.0)

    def initialise(self) -> None:
        """Start to record the way."""
        self._trail = OdometryTrail()
        self._start: FollowStart | None = None
        self._errors = RootMeanSquare()
        self.expect_motion()

    def expect_motion(self) -> None:
        """Watch from now on whether the robot moves."""
        self._watch = StuckWatch(self.start_timer(), self.robot.base.odometry)

    @property
    def is_stuck(self) -> bool:
        """Whether the robot does not move."""
        return self._watch.is_stuck(self.robot.base.odometry)

    def no_progress(self) -> Status:
        """Fail because the robot is stuck."""
        return self.fail(FailureCode.NO_PROGRESS, f"no progress for {STUCK_TIME:g} s")

    def record_way(self) -> None:
        """Add the present pose to the way; in each tick."""
        self._trail.record(self.robot.time, self.robot.base.odometry)

    def begin_here(self) -> None:
        """Let the `until_…` ports count from here."""
        self._start = FollowStart(
            self.start_timer(), self._trail.distance, self.robot.localisation.pose
        )

    @property
    def way_followed(self) -> float:
        """Distance since `begin_here`, metres; 0 before."""
        return 0.0 if self._start is None else self._trail.distance - self._start.travelled

    @property
    def is_limit_reached(self) -> bool:
        """Whether one of the `until_…` ports is reached."""
        start, here = self._start, self.robot.localisation.pose
        if start is None:
            return False
        travelled, time, place = self.until_travelled, self.until_time, self.until_place
        return (
            (travelled is not None and self.way_followed >= travelled)
            or (time is not None and start.timer.is_over(time))
            or (place is not None and here.distance_to(place) <= self.place_radius)
        )
