"""What can be seen of a map from some places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from stack.types import UNKNOWN, OccupancyGrid, Pose2D


def only_in_view(grid: OccupancyGrid, places: Sequence[Pose2D], reach: float) -> OccupancyGrid:
    """Return a map on which the free cells out of view are unknown.

    Args:
        grid: the map.
        places: at which the robot has looked all round, map frame.
        reach: of the view, metres.
    """
    seen = np.zeros(grid.cells.shape, np.bool_)
    for place in places:
        seen |= cells_in_view(grid, place, reach)
    return replace(grid, cells=np.where(grid.free & ~seen, np.int8(UNKNOWN), grid.cells))


def cells_in_view(grid: OccupancyGrid, place: Pose2D, reach: float) -> NDArray[np.bool_]:
    """Return (rows, columns): whether no occupied cell hides a cell from a place.

    Args:
        grid: the map; unknown cells hide nothing.
        place: map frame.
        reach: of the view, metres.
    """
    steps = 2 * ceil(reach / grid.resolution)  # half a cell each
    angles = np.arange(0.0, 2.0 * pi, 1.0 / (0.5 * steps))
    away = 0.5 * np.arange(steps + 1)
    row, column = grid.cell_at(place.x, place.y)
    rows = np.rint(row + np.outer(np.sin(angles), away)).astype(np.int64)
    columns = np.rint(column + np.outer(np.cos(angles), away)).astype(np.int64)
    height, width = grid.cells.shape
    inside = (rows >= 0) & (columns >= 0) & (rows < height) & (columns < width)
    rows, columns = np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)
    blocks = ~inside | grid.occupied[rows, columns]
    visible = ~np.logical_or.accumulate(blocks, axis=1)
    seen = np.zeros(grid.cells.shape, np.bool_)
    seen[rows[visible], columns[visible]] = True
    return seen
