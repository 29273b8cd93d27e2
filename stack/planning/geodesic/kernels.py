# mypy: allow-untyped-defs
"""Compiled descent of a path's cost integral with a penalty on its bends; mixes of two paths."""

import numpy as np
from numba import f8, i8, u1

from stack.kernel_cache import njit
from stack.planning.kernels import _line_cost

_PROBE = 0.1  # cells; distance of the points that give slope and curvature of the energy
_STEP = 0.5  # cells; largest move of a point in one pass
BLEND_STEPS = 4  # steps of the share of a smoothed path, from 0 to 1
_ROUNDING = 1e-6  # steps; lines between points one cell apart are sampled alike
_BLOCKED = 1e6  # cost per cell of a line that crosses impassable cells: the escape from a start


@njit(cache=True, nogil=True)
def _weight(costs, traverse, x, y):
    """Step cost at a point, in cells, interpolated bilinearly; impassable cells count as 252."""
    rows, columns = costs.shape
    column, row = int(np.floor(x - 0.5)), int(np.floor(y - 0.5))
    right, up = x - 0.5 - column, y - 0.5 - row
    total = 0.0
    for rise in range(2):
        for run in range(2):
            at_row = min(max(row + rise, 0), rows - 1)
            at_column = min(max(column + run, 0), columns - 1)
            value = traverse[costs[at_row, at_column]]
            if value == 0:
                value = traverse[252]
            total += value * (right if run else 1.0 - right) * (up if rise else 1.0 - up)
    return total


@njit(cache=True, nogil=True)
def _bend(points, middle, moved, x, y):
    """Squared bend at one point, with point `moved` at (x, y); 0 where it has no neighbours."""
    before, after = middle - 1, middle + 1
    if before < 0 or after >= points.shape[0]:
        return 0.0
    share_x = share_y = 0.0
    for index, factor in ((before, 1.0), (middle, -2.0), (after, 1.0)):
        share_x += factor * (x if index == moved else points[index, 0])
        share_y += factor * (y if index == moved else points[index, 1])
    return share_x * share_x + share_y * share_y


@njit(cache=True, nogil=True)
def _energy(costs, traverse, points, index, x, y, stiffness, before, after):
    """Part of the energy that depends on point `index`, were it at (x, y).

    `before` and `after` are the step costs at its neighbours.
    """
    here = _weight(costs, traverse, x, y)
    total = 0.0
    for other, there in ((index - 1, before), (index + 1, after)):
        near_x, near_y = points[other, 0], points[other, 1]
        square = (x - near_x) * (x - near_x) + (y - near_y) * (y - near_y)
        total += 0.5 * (here + there) * np.sqrt(square)
    for middle in (index - 1, index, index + 1):
        total += stiffness * _bend(points, middle, index, x, y)
    return total


@njit(cache=True, nogil=True)
def descend(costs, traverse, points, stiffness, passes):
    """Move points (n, 2), in cells, across their path until cost and bending energy fall no more.

    The energy is the integral of step cost plus `stiffness` times squared curvature over length.
    Each point moves along the normal of its path by a Newton step, only if the energy falls and
    the lines to its neighbours are passable; the ends are fixed.

    Args:
        costs: (rows, columns) uint8.
        traverse: (256,) cost of a straight step by cell cost, 0 if impassable.
        points: (n, 2) evenly spaced, in cells.
        stiffness: step cost times cells squared.
        passes: number of passes over the points.

    Returns:
        (n, 2) moved points.
    """
    moved = points.copy()
    for _ in range(passes):
        for index in range(1, points.shape[0] - 1):
            x, y = moved[index, 0], moved[index, 1]
            run, rise = moved[index + 1] - moved[index - 1]
            length = np.hypot(run, rise)
            if length < 1e-6:
                continue
            across_x, across_y = -rise / length, run / length
            factor = stiffness * 8.0 / length**3
            before = _weight(costs, traverse, moved[index - 1, 0], moved[index - 1, 1])
            after = _weight(costs, traverse, moved[index + 1, 0], moved[index + 1, 1])
            energy = _energy(costs, traverse, moved, index, x, y, factor, before, after)
            dx, dy = _PROBE * across_x, _PROBE * across_y
            left = _energy(costs, traverse, moved, index, x + dx, y + dy, factor, before, after)
            right = _energy(costs, traverse, moved, index, x - dx, y - dy, factor, before, after)
            slope = 0.5 * (left - right) / _PROBE
            curve = max((left - 2.0 * energy + right) / _PROBE**2, 1.0)
            step = min(max(-slope / curve, -_STEP), _STEP)
            new_x, new_y = x + step * across_x, y + step * across_y
            if abs(step) < 1e-3:
                continue
            new = _energy(costs, traverse, moved, index, new_x, new_y, factor, before, after)
            if new >= energy:
                continue
            free = True
            for other in (index - 1, index + 1):
                near_x, near_y = moved[other, 0], moved[other, 1]
                if _line_cost(costs, traverse, new_x, new_y, near_x, near_y, np.inf) < 0.0:
                    free = False
            if free:
                moved[index, 0], moved[index, 1] = new_x, new_y
    return moved


@njit(cache=True, nogil=True)
def _segment_cost(costs, traverse, x1, y1, x2, y2):
    """Integral of interpolated step cost along a line, in cells; 1e6 a cell if it is blocked."""
    length = np.hypot(x2 - x1, y2 - y1)
    if _line_cost(costs, traverse, x1, y1, x2, y2, np.inf) < 0.0:
        return _BLOCKED * length
    steps = max(int(np.ceil(2.0 * length - _ROUNDING)), 1)
    total = 0.0
    for step in range(steps):
        share = (step + 0.5) / steps
        weight = _weight(costs, traverse, x1 + share * (x2 - x1), y1 + share * (y2 - y1))
        total += weight * length / steps
    return total


@njit(cache=True, nogil=True)
def path_cost(costs, traverse, points):
    """Integral of interpolated step cost along points (n, 2), in cells.

    Lines over impassable cells cost 1e6 a cell.
    """
    total = 0.0
    for index in range(1, points.shape[0]):
        x1, y1 = points[index - 1, 0], points[index - 1, 1]
        x2, y2 = points[index, 0], points[index, 1]
        total += _segment_cost(costs, traverse, x1, y1, x2, y2)
    return total


@njit(cache=True, nogil=True)
def blend(costs, traverse, points, smooth, surcharge, switch):
    """Mix of a path and its smoothed version that costs least: dynamic programming over shares.

    Each point goes a share of 0, 1/4, ... 1 of the way from `points` to `smooth`; neighbours differ
    by 1/4 at most, so that parts of both paths join without a kink.

    Args:
        costs: (rows, columns) uint8.
        traverse: (256,) cost of a straight step by cell cost, 0 if impassable.
        points: (n, 2) path, in cells.
        smooth: (n, 2) its points after smoothing; the ends are the same.
        surcharge: step cost of a point that stays at `points`, in proportion to the way that it
            stays behind. At 0 the mix never costs more than either path.
        switch: step cost of a change of the share by 1/4.

    Returns:
        (n, 2) points of the mix.
    """
    count, top = points.shape[0], BLEND_STEPS
    best = np.zeros(top + 1)
    came = np.zeros((count, top + 1), np.int64)
    for index in range(1, count):
        arrived = np.full(top + 1, np.inf)
        for level in range(top + 1):
            share = level / top
            x = points[index, 0] + share * (smooth[index, 0] - points[index, 0])
            y = points[index, 1] + share * (smooth[index, 1] - points[index, 1])
            for other in range(max(level - 1, 0), min(level + 1, top) + 1):
                share = other / top
                from_x = points[index - 1, 0]
                from_x += share * (smooth[index - 1, 0] - from_x)
                from_y = points[index - 1, 1]
                from_y += share * (smooth[index - 1, 1] - from_y)
                total = best[other] + switch * abs(level - other)
                total += surcharge * (1.0 - level / top)
                total += _segment_cost(costs, traverse, from_x, from_y, x, y)
                if total < arrived[level]:
                    arrived[level], came[index, level] = total, other
        best = arrived
    mix = points.copy()
    level = int(np.argmin(best))
    for index in range(count - 1, -1, -1):
        share = level / top
        for axis in range(2):
            mix[index, axis] += share * (smooth[index, axis] - points[index, axis])
        level = came[index, level]
    return mix


COSTING = ((path_cost, (u1[:, ::1], i8[::1], f8[:, ::1])),)
"""Entry points, with the types that smoothers call them with; then for one smoother each."""
GEODESIC = ((descend, (u1[:, ::1], i8[::1], f8[:, ::1], f8, i8)), *COSTING)
BLENDING = ((blend, (u1[:, ::1], i8[::1], f8[:, ::1], f8[:, ::1], f8, f8)), *COSTING)
