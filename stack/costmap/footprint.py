"""Does the robot's outline fit where it stands, and all along a path?

A round robot is in collision where the cell under its centre is inscribed (253) or lethal (254).
For any outline these functions look at all cells under it, among which only lethal ones mean
contact: cells near an obstacle are inscribed for the centre's sake.
"""

from __future__ import annotations

from functools import lru_cache
from math import ceil, cos, sin

import numpy as np

from stack.types import FREE_COST, UNKNOWN_COST, CostGrid, FloatArray, Footprint, Pose2D


def footprint_cost(
    grid: CostGrid, footprint: Footprint, pose: Pose2D, *, unknown: int = UNKNOWN_COST
) -> int:
    """The largest cost under the footprint, outline and interior.

    Args:
        grid: costs, map frame.
        footprint: outline in the base frame.
        pose: of the base, map frame.
        unknown: what unknown cells and places outside the grid count as: UNKNOWN_COST (255) and
            LETHAL_COST (254) make them collisions, FREE_COST (0) ignores them.

    Returns:
        A cost; LETHAL_COST or more is contact.
    """
    from stack.costmap import kernels

    return int(
        kernels.footprint_cost(
            grid.cells, *grid.origin, grid.resolution, samples(footprint, grid.resolution),
            pose.x, pose.y, cos(pose.heading), sin(pose.heading), unknown,
        )
    )  # fmt: skip


def first_blocked(
    grid: CostGrid, points: FloatArray, footprint: Footprint | float, *, unknown: int = FREE_COST
) -> int | None:
    """Index of the first pose at which the robot would touch something; None when all are clear.

    Args:
        grid: costs, map frame.
        points: (n, 3) poses x, y, heading, map frame.
        footprint: outline in the base frame, or the radius of a round robot in metres.
        unknown: what unknown cells and places outside the grid count as; by default they are
            taken to be free, for a path reaches beyond a local costmap.
    """
    from stack.costmap import kernels

    outline = footprint if isinstance(footprint, Footprint) else Footprint.circle(footprint)
    index = kernels.first_blocked(
        grid.cells, *grid.origin, grid.resolution, samples(outline, grid.resolution),
        np.ascontiguousarray(points, dtype=np.float64), unknown,
    )  # fmt: skip
    return None if index < 0 else int(index)


def path_is_clear(
    grid: CostGrid, points: FloatArray, footprint: Footprint | float, *, unknown: int = FREE_COST
) -> bool:
    """Whether the robot touches nothing at any pose of (n, 3); see `first_blocked`."""
    return first_blocked(grid, points, footprint, unknown=unknown) is None


def samples(footprint: Footprint, resolution: float) -> FloatArray:
    """(n, 2) points on and in a footprint, so dense that no cell inside is missed; base frame."""
    corners = np.ascontiguousarray(footprint.points, dtype=np.float64)
    return _samples(corners.tobytes(), resolution)


@lru_cache(maxsize=32)
def _samples(corners: bytes, resolution: float) -> FloatArray:
    points = np.frombuffer(corners, dtype=np.float64).reshape(-1, 2)
    spacing = 0.7 * resolution  # a turned lattice this fine has a point in every cell: 0.7 < 1/√2
    outline = []
    for start, end in zip(points, np.roll(points, -1, axis=0), strict=True):
        steps = max(1, ceil(float(np.linalg.norm(end - start)) / spacing))
        outline.append(
            start + np.linspace(0.0, 1.0, steps, endpoint=False)[:, None] * (end - start)
        )
    low, high = points.min(axis=0), points.max(axis=0)
    x, y = np.meshgrid(
        np.arange(low[0], high[0] + spacing, spacing), np.arange(low[1], high[1] + spacing, spacing)
    )
    lattice = np.column_stack([x.ravel(), y.ravel()])
    return np.ascontiguousarray(np.vstack([*outline, lattice[inside(points, lattice)]]))


def inside(corners: FloatArray, points: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """Which of the points (n, 2) a horizontal ray leaves through an odd number of edges."""
    inside = np.zeros(len(points), dtype=bool)
    x, y = points[:, 0], points[:, 1]
    for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y1 != y2:
            crosses = (y1 > y) != (y2 > y)
            inside ^= crosses & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside
