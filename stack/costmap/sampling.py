"""Resampling of a grid at the centres of a costmap's cells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import Box, Frame
from stack.types import OccupancyGrid


def sampled(grid: OccupancyGrid, frame: Frame, box: Box, outside: int) -> NDArray[np.int8]:
    """Return the grid's values at a box's cell centres, (rows, columns); `outside` off the grid."""
    scale = frame.resolution / grid.resolution
    (x, y), (left, low) = frame.origin, grid.origin
    row = np.floor((y - low) / grid.resolution + (np.arange(*box[:2]) + 0.5) * scale)
    column = np.floor((x - left) / grid.resolution + (np.arange(*box[2:]) + 0.5) * scale)
    on_rows = (row >= 0) & (row < grid.cells.shape[0])
    on_columns = (column >= 0) & (column < grid.cells.shape[1])
    values = np.full((row.size, column.size), outside, dtype=np.int8)
    values[np.ix_(on_rows, on_columns)] = grid.cells[
        np.ix_(row[on_rows].astype(int), column[on_columns].astype(int))
    ]
    return values
