"""Whether the end of a path is reached, so that only the final heading is left."""

from __future__ import annotations

from stack.types import Path, Pose2D

SAME_GOAL = 0.02
"""Metres by which a new path's end may differ and still be the same goal."""


class Arrival:
    """Notices that a robot is at the goal's position, and then holds to it.

    Turning in place moves a robot a little. It is sent off again only when a new path leads to
    another goal, or when it has come away by more than twice the distance asked for.
    """

    def __init__(self) -> None:
        self._goal: Pose2D | None = None
        self._arrived = False

    def set_path(self, path: Path) -> None:
        """Another path is to be followed."""
        if self._goal is None or self._goal.distance_to(path.goal) > SAME_GOAL:
            self._arrived = False
        self._goal = path.goal

    def reached(self, pose: Pose2D, position: float) -> bool:
        """Whether the pose (map frame) is at the goal, within `position` metres."""
        if self._goal is None:
            return False
        distance = pose.distance_to(self._goal)
        self._arrived = distance <= position * (2.0 if self._arrived else 1.0)
        return self._arrived
