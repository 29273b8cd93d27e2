"""Savitzky-Golay and constrained smoothing of a polyline, without collision checks."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.geometry.savitzky_golay import savitzky_golay_weights
from stack.types import LETHAL_COST, UNKNOWN_COST, CostGrid, FloatArray

WINDOW, ORDER, PASSES = 7, 3, 2
"""Savitzky-Golay filter: number of points, degree of the polynomials, number of passes."""

_FINE_STAGE = (1, 80, np.array([0.04, 0.0, 0.08, 0.0]))  # removes kinks of the size of a cell
_STAGES = (
    (4, 60, np.array([0.04, 0.06, 0.06, 0.002])),
    (2, 60, np.array([0.04, 0.02, 0.08, 0.002])),
    _FINE_STAGE,
)
"""Stride, iterations, and weights of smoothness, clearance, curvature and distance."""
_STAGES_WITH_HEADINGS = ((1, 120, np.array([0.04, 0.04, 0.06, 0.002])), _FINE_STAGE)
"""For polylines with fixed headings at the ends, where large strides would leave kinks."""
_RADIUS_MARGIN = 1.15  # target radius over required radius: the descent stops short of its target
_UNKNOWN_VALUE = UNKNOWN_COST // 2  # unknown cells repel like half-inflated ones


def savitzky_golay(points: FloatArray) -> FloatArray:
    """Return points (n, 2) after the filter of Savitzky and Golay (1964); the ends are fixed.

    The polyline is extended by its point reflection at each end, which keeps the ends in place.
    """
    half = WINDOW // 2
    if len(points) <= half:
        return points
    weights = savitzky_golay_weights(half, ORDER)
    for _ in range(PASSES):
        before = 2.0 * points[0] - points[half:0:-1]
        after = 2.0 * points[-1] - points[-2 : -half - 2 : -1]
        longer = np.vstack([before, points, after])
        points = np.column_stack([np.convolve(axis, weights, "valid") for axis in longer.T])
    return points


def constrained(costs: CostGrid, points: FloatArray, radius: float, pinned: int) -> FloatArray:
    """Return points (n, 2) after a descent of smoothness, clearance and curvature together.

    Args:
        costs: map frame.
        points: metres, map frame.
        radius: metres; arcs tighter than this are widened.
        pinned: number of fixed points at each end.
    """
    from stack.planning.smoothers import kernels

    if len(points) <= 2 * pinned:
        return points
    descend: Any = kernels.descend
    scale, origin = costs.resolution, np.array(costs.origin)
    low, high = _box(costs, points)
    field = _field(costs.cells[low[1] : high[1], low[0] : high[0]])
    tightest = scale / (_RADIUS_MARGIN * radius)
    moved = (points - origin) / scale - low
    for stride, iterations, weights in _STAGES if pinned == 1 else _STAGES_WITH_HEADINGS:
        moved = descend(field, moved, pinned, stride, tightest, weights, iterations)
    shaped: FloatArray = (moved + low) * scale + origin
    shaped[:pinned], shaped[len(points) - pinned :] = points[:pinned], points[-pinned:]
    return shaped


def _box(costs: CostGrid, points: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return (column, row) of the lower and upper corner of the grid part around points."""
    cells = np.floor((points - np.array(costs.origin)) / costs.resolution).astype(np.int64)
    rows, columns = costs.cells.shape
    margin = 20
    low = np.maximum(cells.min(axis=0) - margin, 0)
    high = np.minimum(cells.max(axis=0) + margin + 1, [columns, rows])
    return low, high


def _field(cells: NDArray[np.uint8]) -> NDArray[np.float32]:
    values = cells.astype(np.float32)
    values[cells == UNKNOWN_COST] = _UNKNOWN_VALUE
    values /= LETHAL_COST
    return values
