"""What no sensor of the robot sees: walls of the map in blind sectors, and keep-out zones."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from stack.types import LETHAL_COST, CostGrid, FloatArray, ObstaclePoints, Pose2D

T = TypeVar("T", bound=np.generic)


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
    if not len(obstacles.blind_sectors):
        return np.empty((0, 2))
    near, first = cells_around(ground, ground.cells, pose, reach)
    points = _centres(ground, near == LETHAL_COST, first, pose)
    unseen: FloatArray = points[obstacles.are_blind(np.arctan2(points[:, 1], points[:, 0]))]
    return unseen


def zone_edges(
    zones: Iterable[NDArray[np.bool_]], grid: CostGrid, pose: Pose2D, reach: float
) -> FloatArray:
    """Return the (m, 2) centres of the cells at the edges of keep-out zones, base frame, metres.

    Args:
        zones: cells (rows, columns) of each.
        grid: whose cells they are, map frame.
        pose: of the robot, map frame.
        reach: metres around the base.
    """
    found = [np.empty((0, 2))]
    for zone in zones:
        near, first = cells_around(grid, zone, pose, reach)
        padded = np.pad(near, 1, mode="edge")
        inside = padded[2:, 1:-1] & padded[:-2, 1:-1] & padded[1:-1, 2:] & padded[1:-1, :-2]
        found.append(_centres(grid, near & ~inside, first, pose))
    return np.concatenate(found)


def cells_around(
    grid: CostGrid, cells: NDArray[T], pose: Pose2D, reach: float
) -> tuple[NDArray[T], tuple[int, int]]:
    """Return the cells of a grid around a pose, and (row, column) of the first one."""
    row, column = grid.cell_at(pose.x, pose.y)
    half = int(reach / grid.resolution) + 1
    top, left = max(row - half, 0), max(column - half, 0)
    bottom, right = max(row + half + 1, 0), max(column + half + 1, 0)
    return cells[top:bottom, left:right], (top, left)


def _centres(
    grid: CostGrid, marked: NDArray[np.bool_], first: tuple[int, int], pose: Pose2D
) -> FloatArray:
    """Return the (m, 2) centres of the marked cells, base frame of a pose, metres."""
    rows, columns = np.nonzero(marked)
    cells = np.column_stack([columns + first[1], rows + first[0]]).astype(np.float64) + 0.5
    centres: FloatArray = cells * grid.resolution + np.array(grid.origin)
    return pose.inverse().transform(centres)
