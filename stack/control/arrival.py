"""Detects that the end position of a path is reached and only the final heading is left."""

from __future__ import annotations

from stack.types import Path, Pose2D

SAME_GOAL = 0.02
"""Metres up to which the end of a new path counts as the same goal."""


class Arrival:
    """Remembers that the robot has reached the goal's position.

    Turning in place moves a robot slightly. The position counts as left only when a new path leads
    to another goal, or when the robot is farther away than twice the tolerance.
    """

    def __init__(self) -> None:
        self._goal: Pose2D | None = None
        self._arrived = False

    def set_path(self, path: Path) -> None:
        """Set the path to follow."""
        if self._goal is None or self._goal.distance_to(path.goal) > SAME_GOAL:
            self._arrived = False
        self._goal = path.goal

    def reached(self, pose: Pose2D, position: float) -> bool:
        """Whether a pose (map frame) is at the goal's position, within `position` metres."""
        if self._goal is None:
            return False
        distance = pose.distance_to(self._goal)
        self._arrived = distance <= position * (2.0 if self._arrived else 1.0)
        return self._arrived
