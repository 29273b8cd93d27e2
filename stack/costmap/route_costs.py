"""Cost of a path on a costmap, and whether it is blocked."""

from __future__ import annotations

import numpy as np

from stack.geometry.costs_under import costs_under
from stack.types import INSCRIBED_COST, UNKNOWN_COST, CostGrid, FloatArray, Pose2D

COST_WEIGHT = 3.0
"""Extra metres counted per metre at the highest passable cost."""


def route_cost(costs: CostGrid, points: FloatArray) -> float:
    """Length of a polyline (n, 2), metres; each metre counts 1 to 1 + COST_WEIGHT by its cost."""
    under = costs_under(costs, points).astype(np.float64)
    under[under == UNKNOWN_COST] = 0.0
    steps = np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1)
    return float(steps @ (1.0 + COST_WEIGHT * under[1:] / (INSCRIBED_COST - 1)))


def blocked_at(
    costs: CostGrid, points: FloatArray, pose: Pose2D, near: float, least: int = INSCRIBED_COST
) -> tuple[float, float] | None:
    """Return the first point (x, y) of a path at which the robot would collide, or None.

    Args:
        costs: costmap.
        points: (n, 2) path ahead, map frame.
        pose: of the robot.
        near: points within this many metres of the robot are ignored.
        least: costs from this value on are collisions; LETHAL_COST: only obstacles on the path
            itself.
    """
    from stack.costmap.kernels import first_collision  # imports numba

    number: int = first_collision(
        costs.cells, *costs.origin, costs.resolution, np.ascontiguousarray(points[:, :2]),
        pose.x, pose.y, near, least,
    )  # fmt: skip
    return (float(points[number, 0]), float(points[number, 1])) if number >= 0 else None
