"""Costs of a costmap under points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.types import UNKNOWN_COST, CostGrid, FloatArray


def costs_under(costs: CostGrid, points: FloatArray) -> NDArray[np.uint8]:
    """Return the (n,) costs under points (n, 2 or more), map frame; UNKNOWN_COST off the grid."""
    rows, columns = costs.cells.shape
    column, row = np.floor((points[:, :2] - costs.origin) / costs.resolution).astype(int).T
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    found = np.full(len(points), UNKNOWN_COST, dtype=np.uint8)
    found[inside] = costs.cells[row[inside], column[inside]]
    return found
