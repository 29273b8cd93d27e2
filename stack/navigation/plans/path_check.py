"""Checks whether the path ahead is blocked in the costmap."""

from __future__ import annotations

import numpy as np

from stack.costmap.route_costs import blocked_at
from stack.geometry.path_progress import PathProgress
from stack.navigation.drive_tools import DriveTools
from stack.navigation.plans.choice import NEAR_ENOUGH
from stack.types import Pose2D


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
