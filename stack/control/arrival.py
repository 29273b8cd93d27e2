"""Detects that the goal's position is reached and only the final heading is left."""

from __future__ import annotations

from stack.components import GoalTolerance, StopCriterion
from stack.control.parameters import SHARE
from stack.geometry.path_segment import PathSegment
from stack.types import Path, Pose2D

SAME_GOAL = 0.02
"""Metres up to which the end of a new path counts as the same goal."""

SAME_POSITION = 0.06
"""Distance to the goal in metres within which a new short path to it counts as arrived, at most;
half of the tolerance if that is less."""


class Arrival:
    """Remembers that the robot has reached the goal's position.

    Turning in place moves a robot slightly. Measured straight to the goal, the position counts as
    left only when a new path leads to another goal, or when the robot is farther away than twice
    the distance of the criterion. Measured along the path, it counts until the next path.
    """

    def __init__(self) -> None:
        self._goal: Pose2D | None = None
        self._arrived, self._fresh = False, True
        self._same = SAME_POSITION

    def set_path(self, path: Path, tolerance: GoalTolerance) -> None:
        """Set the path to follow, and how near to its end is enough."""
        same_goal = min(SAME_GOAL, SHARE * tolerance.position)
        if self._goal is None or self._goal.distance_to(path.goal) > same_goal:
            self._arrived = False
        self._same = min(SAME_POSITION, SHARE * tolerance.position)
        self._goal, self._fresh = path.goal, True

    def reached(self, pose: Pose2D, segment: PathSegment, criterion: StopCriterion) -> bool:
        """Whether the robot is at the goal's position.

        Args:
            pose: of the robot, map frame.
            segment: that it drives, up to date with the pose.
            criterion: of the controller.
        """
        if self._goal is None or not segment.is_last:
            return False
        distance = pose.distance_to(self._goal)
        if not criterion.along_path:
            limit = criterion.distance * (2.0 if self._arrived else 1.0)
            ends = self._arrived or segment.ends_within(criterion.distance)
            self._arrived = distance <= limit and ends
            return self._arrived
        if self._fresh:
            short = segment.length <= 2.0 * self._same
            self._arrived = short and distance <= self._same
        self._fresh = False
        self._arrived = self._arrived or segment.remaining <= criterion.distance
        return self._arrived
