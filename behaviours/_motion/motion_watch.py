"""What following behaviours watch: whether the robot moves, and whether they are over."""

from __future__ import annotations

from dataclasses import dataclass

from behaviours.timer import Timer
from stack.types import Pose2D

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


@dataclass(frozen=True, slots=True)
class FollowLimits:
    """Ports that end a following behaviour; None: no such end.

    Attributes:
        travelled: distance, metres.
        time: duration, seconds.
        place: map frame.
        radius: around the place, metres.
    """

    travelled: float | None
    time: float | None
    place: Pose2D | None
    radius: float

    def are_reached(self, start: FollowStart, travelled: float, here: Pose2D) -> bool:
        """Return whether one of them is reached.

        Args:
            start: of the following.
            travelled: distance driven since then, metres.
            here: pose of the robot, map frame.
        """
        return (
            (self.travelled is not None and travelled >= self.travelled)
            or (self.time is not None and start.timer.is_over(self.time))
            or (self.place is not None and here.distance_to(self.place) <= self.radius)
        )
