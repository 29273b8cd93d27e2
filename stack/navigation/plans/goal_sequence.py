"""The goals of a drive in turn, and which of them the robot has passed."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from stack.types import Pose2D

PASSED_WHEN_RECEDING = 0.02
"""Increase of the distance to a via pose, in metres, after which the pose is passed."""


class GoalSequence:
    """Goals that are driven through in turn; only the last one is reached exactly.

    Args:
        goals: map frame, at least one.

    Attributes:
        left: the goals that are not passed yet, the last one included.
    """

    def __init__(self, goals: Sequence[Pose2D]) -> None:
        self.left = tuple(goals)
        self._leg_ends: tuple[float, ...] = ()
        self._nearest = inf

    @property
    def next(self) -> Pose2D:
        """The goal that is driven to."""
        return self.left[0]

    @property
    def only_last_left(self) -> bool:
        """Whether all via goals are passed."""
        return len(self.left) == 1

    def follow(self, leg_ends: tuple[float, ...]) -> None:
        """Set where a new path passes the goals that are left.

        Args:
            leg_ends: metres along the path, one for each goal.
        """
        self._leg_ends = leg_ends

    def replace_last(self, place: Pose2D) -> None:
        """End at another pose, map frame; the via goals are passed."""
        self.left = (place,)

    def pass_by(self, pose: Pose2D, travelled: float, radius: float, *, waiting: bool) -> None:
        """Remove the via goals that have been passed.

        A goal is passed when the robot was within a radius of it and moves away or cannot get
        nearer, or when the robot has driven that part of the path.

        Args:
            pose: of the robot, map frame.
            travelled: along the path, metres.
            radius: metres around a goal.
            waiting: whether the robot stands in front of an obstacle.
        """
        while len(self.left) > 1 and len(self._leg_ends) == len(self.left):
            distance = pose.distance_to(self.left[0])
            self._nearest = min(self._nearest, distance)
            receding = distance > self._nearest + PASSED_WHEN_RECEDING or waiting
            near = self._nearest <= radius
            if not (near and receding) and travelled < self._leg_ends[0]:
                break
            self.left, self._leg_ends = self.left[1:], self._leg_ends[1:]
            self._nearest = inf
