"""The end of a path that leads only to the nearest reachable pose."""

from __future__ import annotations

from math import inf

from stack.navigation.following import Follower
from stack.navigation.plans.choice import NEAR_ENOUGH
from stack.types import Path, Pose2D

MOVES_AWAY = 0.05
"""Increase of the distance to the end of a partial path, in metres, after which the robot has been
as near as it gets. A controller that makes room for its turn to the goal's heading in front of an
obstacle would drive to and fro.
"""


class PartialEnd:
    """Judges whether the robot is as near to the end of a partial path as it gets."""

    def __init__(self) -> None:
        self._nearest = inf

    def reached(self, path: Path | None, follower: Follower, pose: Pose2D) -> bool:
        """Whether the robot is at the end of a partial path and gets no nearer to it.

        Args:
            path: that is driven; None without one.
            follower: of the path.
            pose: of the robot, map frame.
        """
        if path is None or not path.partial or not follower.at_position:
            self._nearest = inf
            return False
        distance = pose.distance_to(path.goal)
        self._nearest = min(self._nearest, distance)
        return follower.waiting or distance > self._nearest + MOVES_AWAY


def near_partial_end(path: Path | None, follower: Follower) -> bool:
    """Whether the robot is near the end of a partial path, where an obstacle is expected.

    Args:
        path: that is driven; None without one.
        follower: of the path.
    """
    progress = follower.progress
    partial = path is not None and path.partial
    return partial and progress is not None and progress.remaining <= NEAR_ENOUGH
