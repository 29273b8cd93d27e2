"""Checks whether the path ahead is blocked in the costmap, and whether its partial end is near."""

from __future__ import annotations

from math import inf

import numpy as np

from stack.costmap.route_costs import blocked_at
from stack.geometry.path_progress import PathProgress
from stack.navigation.drive_tools import DriveTools
from stack.navigation.following import Follower
from stack.navigation.plans.choice import NEAR_ENOUGH
from stack.types import Path, Pose2D

MOVES_AWAY = 0.05
"""Increase of the distance to the end of a partial path, in metres, after which the robot has been
as near as it gets. A controller that makes room for its turn to the goal's heading in front of an
obstacle would drive to and fro.
"""


class PathCheck:
    """Looks for the first blocked point of the path ahead whenever the costs have changed.

    Args:
        tools: of the drive.

    Attributes:
        blocked_at: (x, y) in the map frame, metres; None while the path is free.
    """

    def __init__(self, tools: DriveTools) -> None:
        self._tools = tools
        self._seen_version = -1
        self.blocked_at: tuple[float, float] | None = None

    def update(self, progress: PathProgress | None, pose: Pose2D) -> None:
        """Check the next metres of the path, as far as `look_ahead`.

        An obstacle at the end of a partial path is expected and not counted.

        Args:
            progress: on the path; None without one.
            pose: of the robot, map frame.
        """
        costmap = self._tools.global_costmap
        if progress is None or costmap.version == self._seen_version:
            return
        self._seen_version = costmap.version
        points = progress.ahead(self._tools.parameters.look_ahead)
        if progress.path.partial:
            end = progress.path.goal
            points = points[np.hypot(points[:, 0] - end.x, points[:, 1] - end.y) > NEAR_ENOUGH]
        self.blocked_at = blocked_at(
            costmap.view, points, pose, self._tools.robot.footprint.inscribed_radius
        )

    def forget_blockage(self) -> None:
        """Count the path as free until the costs change."""
        self.blocked_at = None

    def start(self) -> None:
        """Check a new path at the next update."""
        self.blocked_at, self._seen_version = None, -1


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
