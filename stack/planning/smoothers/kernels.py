# mypy: allow-untyped-defs
"""Compiled gradient descent of the constrained smoother."""

import numpy as np
from numba import f4, f8, i8

from stack.kernel_cache import njit


@njit(cache=True, nogil=True)
def _slope(field, x, y):
    """Gradient of a field of cell values by central differences; 0 at the edge of the grid."""
    rows, columns = field.shape
    column, row = int(np.floor(x)), int(np.floor(y))
    if not (1 <= row < rows - 1 and 1 <= column < columns - 1):
        return 0.0, 0.0
    return (
        0.5 * (field[row, column + 1] - field[row, column - 1]),
        0.5 * (field[row + 1, column] - field[row - 1, column]),
    )


@njit(cache=True, nogil=True)
def descend(field, points, pinned, stride, tightest, weights, iterations):
    """Move points (n, 2), in cells, down the gradient of a path cost.

    The cost has the terms of Dolgov et al. (2010): smoothness sum |p[i-k] - 2 p[i] + p[i+k]|², the
    cost of the cells under the points, curvature above a limit, and the distance of the points
    from their initial positions.

    Args:
        field: (rows, columns) float32 cost of each cell, 0 to 1.
        points: (n, 2) initial points, in cells.
        pinned: number of fixed points at each end.
        stride: k; a large one straightens long bends in few iterations.
        tightest: largest curvature without cost, per cell.
        weights: (4,) of smoothness (below 1/16 for stability), clearance, curvature and distance.
        iterations: steps of the descent.

    Returns:
        (n, 2) moved points.
    """
    count = points.shape[0]
    moved = points.copy()
    bends = np.zeros((count, 2))
    excess = np.zeros((count, 2))
    for _ in range(iterations):
        for index in range(stride, count - stride):
            before, after = moved[index - stride], moved[index + stride]
            x = before[0] - 2.0 * moved[index, 0] + after[0]
            y = before[1] - 2.0 * moved[index, 1] + after[1]
            bends[index, 0], bends[index, 1] = x, y
            step = 0.5 * np.hypot(after[0] - before[0], after[1] - before[1])
            bend = np.hypot(x, y)
            over = max(0.0, bend - tightest * step * step) / max(bend, 1e-12)
            excess[index, 0], excess[index, 1] = over * x, over * y
        for index in range(pinned, count - pinned):
            slope_x, slope_y = _slope(field, moved[index, 0], moved[index, 1])
            below, above = max(index - stride, 0), min(index + stride, count - 1)
            for axis in range(2):
                pull = bends[below, axis] - 2.0 * bends[index, axis] + bends[above, axis]
                sharp = excess[below, axis] - 2.0 * excess[index, axis] + excess[above, axis]
                moved[index, axis] -= weights[0] * pull + weights[2] * sharp
                moved[index, axis] -= weights[1] * (slope_x if axis == 0 else slope_y)
                moved[index, axis] -= weights[3] * (moved[index, axis] - points[index, axis])
    return moved


DESCENT = ((descend, (f4[:, ::1], f8[:, ::1], i8, i8, f8, f8[::1], i8)),)
"""Entry point, with the types that `Descent` calls it with."""
