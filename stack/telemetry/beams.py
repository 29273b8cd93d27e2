"""Beams of a scan compared with the map, for displays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, OccupancyGrid, Pose2D, Scan

MATCHED, SHORT, LONG = 0, 1, 2
"""A beam ends at something on the map, in front of it, or beyond something on the map."""

TOLERANCE = 0.15
"""Metres between the end of a beam and a mapped surface up to which they match."""


def beam_classes(
    scan: Scan, pose: Pose2D, grid: OccupancyGrid
) -> tuple[FloatArray, NDArray[np.uint8]]:
    """Return the end points of a scan and how each beam compares with the map.

    A short beam ends at something that is not on the map. A long one goes through an obstacle of
    the map that is no longer there, or that is elsewhere.

    Args:
        scan: one scan.
        pose: of the base, map frame.
        grid: the map.

    Returns:
        Points (n, 2) of the beams that returned, map frame, metres; and their classes (n,).
    """
    points = pose.transform(scan.points())
    start = pose.compose(scan.mount)
    classes = np.full(len(points), SHORT, np.uint8)
    cells = _cells(points, grid)
    reach = max(1, round(TOLERANCE / grid.resolution))
    offsets = np.arange(-reach, reach + 1)
    rows = cells[:, 1, None, None] + offsets[:, None]
    columns = cells[:, 0, None, None] + offsets
    matched = _occupied(rows, columns, grid).any(axis=(1, 2))
    classes[matched] = MATCHED
    others = np.flatnonzero(~matched)
    if others.size:
        offset = points[others] - (start.x, start.y)
        lengths = np.hypot(offset[:, 0], offset[:, 1])
        steps = np.arange(grid.resolution, max(grid.resolution, lengths.max()), grid.resolution)
        along = steps < lengths[:, None] - TOLERANCE
        shares = np.minimum(1.0, steps / lengths[:, None])
        way = (start.x, start.y) + shares[:, :, None] * offset[:, None, :]
        crossed = _cells(way.reshape(-1, 2), grid)
        hit = _occupied(crossed[:, 1], crossed[:, 0], grid).reshape(along.shape)
        classes[others[(hit & along).any(axis=1)]] = LONG
    return points, classes


def _cells(points: FloatArray, grid: OccupancyGrid) -> NDArray[np.int64]:
    """Columns and rows (n, 2) of the cells at points (n, 2)."""
    cells: NDArray[np.int64] = np.floor((points - grid.origin) / grid.resolution).astype(np.int64)
    return cells


def _occupied(
    rows: NDArray[np.int64], columns: NDArray[np.int64], grid: OccupancyGrid
) -> NDArray[np.bool_]:
    """Whether cells are occupied; cells outside the grid are not."""
    height, width = grid.cells.shape
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    values = grid.cells[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    occupied: NDArray[np.bool_] = inside & grid.are_occupied(values)
    return occupied
