"""What a path costs on a costmap, and whether it is blocked."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.types import (
    INSCRIBED_COST,
    LETHAL_COST,
    UNKNOWN_COST,
    CostGrid,
    FloatArray,
    Pose2D,
)

COST_WEIGHT = 3.0
"""How much longer a metre counts where an obstacle is nearest."""


def costs_under(costs: CostGrid, points: FloatArray) -> NDArray[np.uint8]:
    """(n,) the cost of the cell under each point (n, 2), map frame; unknown off the grid."""
    rows, columns = costs.cells.shape
    column, row = np.floor((points[:, :2] - costs.origin) / costs.resolution).astype(int).T
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    found = np.full(len(points), UNKNOWN_COST, dtype=np.uint8)
    found[inside] = costs.cells[row[inside], column[inside]]
    return found


def route_cost(costs: CostGrid, points: FloatArray) -> float:
    """Length of a polyline (n, 2), each metre counted 1 to 1 + COST_WEIGHT times by its cost."""
    under = costs_under(costs, points).astype(np.float64)
    under[under == UNKNOWN_COST] = 0.0
    steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    return float(steps @ (1.0 + COST_WEIGHT * under[1:] / (INSCRIBED_COST - 1)))


def blocked_at(
    costs: CostGrid, points: FloatArray, pose: Pose2D, near: float, least: int = INSCRIBED_COST
) -> tuple[float, float] | None:
    """The first point (n, 2) at which the robot would collide, or None.

    Args:
        costs: costmap.
        points: way ahead, map frame.
        pose: of the robot; within `near` metres of it nothing counts, it stands there already.
        near: metres.
        least: cost from which on it is a collision; LETHAL_COST for what lies on the way itself.
    """
    under = costs_under(costs, points)
    away = np.hypot(points[:, 0] - pose.x, points[:, 1] - pose.y)
    bad = np.flatnonzero((under >= least) & (under <= LETHAL_COST) & (away > near))
    return (float(points[bad[0], 0]), float(points[bad[0], 1])) if bad.size else None
