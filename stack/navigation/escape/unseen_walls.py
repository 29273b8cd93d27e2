"""Walls of the map where no sensor of the robot sees: what a corner that swings may touch."""

from __future__ import annotations

import numpy as np

from stack.types import LETHAL_COST, CostGrid, FloatArray, ObstaclePoints, Pose2D


def unseen_walls(
    ground: CostGrid, pose: Pose2D, obstacles: ObstaclePoints, reach: float
) -> FloatArray:
    """Return the (m, 2) centres of the map's occupied cells in blind sectors, base frame, metres.

    Args:
        ground: costs of the map alone, map frame.
        pose: of the robot, map frame.
        obstacles: what the sensors see, and where none does.
        reach: metres around the base.
    """
    nothing = np.empty((0, 2))
    if not len(obstacles.blind_sectors):
        return nothing
    row, column = ground.cell_at(pose.x, pose.y)
    half = int(reach / ground.resolution) + 1
    top, left = max(row - half, 0), max(column - half, 0)
    near = ground.cells[top : max(row + half + 1, 0), left : max(column + half + 1, 0)]
    rows, columns = np.nonzero(near == LETHAL_COST)
    if not rows.size:
        return nothing
    cells = np.column_stack([columns + left, rows + top]).astype(np.float64) + 0.5
    centres: FloatArray = cells * ground.resolution + np.array(ground.origin)
    points = pose.inverse().transform(centres)
    unseen: FloatArray = points[obstacles.are_blind(np.arctan2(points[:, 1], points[:, 0]))]
    return unseen
