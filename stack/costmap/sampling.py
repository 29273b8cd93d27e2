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
    values = np.full((row.size, column.size), outside, dtype=np.int8)
    on_rows, rows = _within(row.astype(int), grid.cells.shape[0])
    on_columns, columns = _within(column.astype(int), grid.cells.shape[1])
    if rows.size and columns.size:
        part = grid.cells[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        if part.shape == (rows.size, columns.size):  # equal cells: no indexing one by one
            values[on_rows, on_columns] = part
        else:
            values[on_rows, on_columns] = part[np.ix_(rows - rows[0], columns - columns[0])]
    return values


def _within(indices: NDArray[np.int64], size: int) -> tuple[slice, NDArray[np.int64]]:
    """Return the slice of ascending indices that are in [0, size), and these indices."""
    first, last = np.searchsorted(indices, [0, size])
    on = slice(int(first), int(last))
    return on, indices[on]
