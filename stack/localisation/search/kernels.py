"""Compiled loops of the search: branch and bound over a grid of scores, and scan alignment.

Grids are (rows, columns) with row 0 at the smallest y. Poses are rows of x, y, heading. Points are
(m, 2) in the base frame, metres.
"""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np
from numba import f4, f8, i4, i8, njit, u1
from numpy.typing import NDArray

from stack.types import FloatArray

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]
Offsets = NDArray[np.int32]

HIGHEST = 255
"""Largest value of a cell."""

START, ROWS, COLUMNS, SHIFT, PAD = 0, 1, 2, 3, 4
"""Columns of a pyramid's layout: first index in the flat array, size, log2 of the stride in cells,
and number of padding entries before row and column 0."""


@njit(cache=True, nogil=True)
def _value(cells: Bytes, layout: Integers, level: int, row: int, column: int) -> int:
    """Largest value in the box of side 2**level cells at (row, column), or a little more."""
    shift, pad = layout[level, SHIFT], layout[level, PAD]
    i, j = (row >> shift) + pad, (column >> shift) + pad
    if i < 0 or j < 0 or i >= layout[level, ROWS] or j >= layout[level, COLUMNS]:
        return 0
    return int(cells[layout[level, START] + i * layout[level, COLUMNS] + j])


@njit(cache=True, nogil=True)
def _bound(
    cells: Bytes,
    layout: Integers,
    level: int,
    row: int,
    column: int,
    offsets: Offsets,
    heading: int,
    least: int,
) -> int:
    """Upper bound of the scores in a box; -1 as soon as it is certain to be below `least`."""
    shift, pad, start = layout[level, SHIFT], layout[level, PAD], layout[level, START]
    rows, columns = layout[level, ROWS], layout[level, COLUMNS]
    total, count = 0, offsets.shape[1]
    for k in range(count):
        i = ((row + offsets[heading, k, 0]) >> shift) + pad
        j = ((column + offsets[heading, k, 1]) >> shift) + pad
        if i >= 0 and j >= 0 and i < rows and j < columns:
            total += cells[start + i * columns + j]
        if k % 8 == 7 and total + (count - 1 - k) * HIGHEST < least:
            return -1
    return total if total >= least else -1


@njit(cache=True, nogil=True)
def search_lattice(
    cells: Bytes,
    layout: Integers,
    allowed: Bytes,
    offsets: Offsets,
    window: Integers,
    least: int,
    fraction: float,
    separation: float,
    heading_separation: int,
    period: int,
    most: int,
    limit: int,
) -> tuple[Integers, int]:
    """Best distinct poses of a lattice by best-first branch and bound.

    W. Hess, D. Kohler, H. Rapp, D. Andor, "Real-Time Loop Closure in 2D LIDAR SLAM", ICRA 2016,
    section V, with a bucket queue in place of depth-first search: poses come in the order of
    their scores, so that the search can continue beyond the best one.

    The result equals this: sort all allowed lattice poses by score (ties by heading, row, column),
    and accept each that is distinct from all accepted before, down to `fraction` of the best score.

    Args:
        cells: pyramid of scores, flat.
        layout: (levels, 5) of both pyramids.
        allowed: pyramid of the cells at which the base may be, 0 or 1, flat.
        offsets: (h, m, 2) rows and columns from the base to the points, for each heading.
        window: (4,) first row, first column, rows, columns of the lattice.
        least: smallest score of a result, at least 1.
        fraction: of the best score, smallest of a result.
        separation: cells; poses nearer than this with a similar heading are not distinct.
        heading_separation: number of headings from which on poses are distinct.
        period: number of headings in a full turn; larger than any difference if they are no turn.
        most: number of results at which the search ends.
        limit: number of boxes at which the search ends.

    Returns:
        (n, 4) score, heading, row, column, best first; and the number of boxes examined, negative
        if the search ended at `limit`.
    """
    headings, count = offsets.shape[0], offsets.shape[1]
    top = layout.shape[0] - 1
    buckets = count * HIGHEST + 1
    heads = np.full(buckets, -1, dtype=np.int64)
    # node: level, heading, row, column, next
    nodes = np.empty((4096, 5), dtype=np.int64)
    used, spare, examined = 0, -1, 0
    results = np.empty((most, 4), dtype=np.int64)
    leaves = np.empty(256, dtype=np.int64)
    found = 0
    end_row, end_column = window[0] + window[2], window[1] + window[3]
    side = 1 << top
    threshold = max(least, 1)
    for heading in range(headings):
        for row in range(window[0], end_row, side):
            for column in range(window[1], end_column, side):
                if _value(allowed, layout, top, row, column) == 0:
                    continue
                examined += 1
                score = _bound(cells, layout, top, row, column, offsets, heading, threshold)
                if score < 0:
                    continue
                if used == nodes.shape[0]:
                    grown = np.empty((2 * used, 5), dtype=np.int64)
                    grown[:used] = nodes
                    nodes = grown
                nodes[used, 0], nodes[used, 1] = top, heading
                nodes[used, 2], nodes[used, 3], nodes[used, 4] = row, column, heads[score]
                heads[score] = used
                used += 1
    for score in range(buckets - 1, 0, -1):
        if score < threshold:
            break
        leaf_count = 0
        while heads[score] >= 0:
            node = heads[score]
            heads[score] = nodes[node, 4]
            level, heading = nodes[node, 0], nodes[node, 1]
            row, column = nodes[node, 2], nodes[node, 3]
            nodes[node, 4], spare = spare, node
            if _is_taken(
                results, found, level, heading, row, column, separation, heading_separation, period
            ):
                continue
            if level == 0:
                if leaf_count == leaves.shape[0]:
                    longer = np.empty(2 * leaf_count, dtype=np.int64)
                    longer[:leaf_count] = leaves
                    leaves = longer
                leaves[leaf_count] = (
                    (heading * window[2] + row - window[0]) * window[3] + column - window[1]
                )
                leaf_count += 1
                continue
            if examined >= limit:
                return results[:found], -examined
            half = 1 << (level - 1)
            for child in range(4):
                r, c = row + half * (child >> 1), column + half * (child & 1)
                if r >= end_row or c >= end_column or _value(allowed, layout, level - 1, r, c) == 0:
                    continue
                examined += 1
                bound = _bound(cells, layout, level - 1, r, c, offsets, heading, threshold)
                if bound < 0:
                    continue
                if spare >= 0:
                    free = spare
                    spare = nodes[free, 4]
                else:
                    if used == nodes.shape[0]:
                        grown = np.empty((2 * used, 5), dtype=np.int64)
                        grown[:used] = nodes
                        nodes = grown
                    free = used
                    used += 1
                nodes[free, 0], nodes[free, 1] = level - 1, heading
                nodes[free, 2], nodes[free, 3], nodes[free, 4] = r, c, heads[bound]
                heads[bound] = free
        ordered = np.sort(leaves[:leaf_count])
        for k in range(leaf_count):
            rest, column = divmod(ordered[k], window[3])
            heading, row = divmod(rest, window[2])
            row += window[0]
            column += window[1]
            if _is_taken(
                results, found, 0, heading, row, column, separation, heading_separation, period
            ):
                continue
            results[found, 0], results[found, 1] = score, heading
            results[found, 2], results[found, 3] = row, column
            found += 1
            if found == 1:
                threshold = max(threshold, int(np.ceil(fraction * score)))
            if found == most:
                return results[:found], examined
    return results[:found], examined


@njit(cache=True, nogil=True)
def _is_taken(
    results: Integers,
    found: int,
    level: int,
    heading: int,
    row: int,
    column: int,
    separation: float,
    heading_separation: int,
    period: int,
) -> bool:
    """Whether one result is not distinct from any pose of a box."""
    last = (1 << level) - 1
    for k in range(found):
        turned = abs(results[k, 1] - heading)
        if min(turned, abs(period - turned)) >= heading_separation:
            continue
        off_row = max(abs(results[k, 2] - row), abs(results[k, 2] - row - last))
        off_column = max(abs(results[k, 3] - column), abs(results[k, 3] - column - last))
        if hypot(off_row, off_column) < separation:
            return True
    return False


@njit(cache=True, nogil=True)
def _distance(field: NDArray[np.float32], u: float, v: float) -> float:
    """Bilinear interpolation of the field at (u, v) cells from its corner, clamped to its edge."""
    rows, columns = field.shape
    u = min(max(u - 0.5, 0.0), columns - 1.001)
    v = min(max(v - 0.5, 0.0), rows - 1.001)
    column, row = int(u), int(v)
    fu, fv = u - column, v - row
    low = field[row, column] * (1.0 - fu) + field[row, column + 1] * fu
    high = field[row + 1, column] * (1.0 - fu) + field[row + 1, column + 1] * fu
    return float(low * (1.0 - fv) + high * fv)


@njit(cache=True, nogil=True)
def align(
    field: NDArray[np.float32],
    resolution: float,
    origin_x: float,
    origin_y: float,
    starts: FloatArray,
    points: FloatArray,
    deviations: FloatArray,
    rounds: int,
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton on the squared distances of the points to the map's surfaces.

    Geman-McClure weights reduce the influence of points far from any surface.

    Args:
        field: signed distance to the nearest surface, metres.
        resolution: metres.
        origin_x: metres.
        origin_y: metres.
        starts: (n, 3) poses.
        points: (m, 2) in the base frame.
        deviations: (k,) residuals in metres whose weight is a quarter, one alignment after another.
        rounds: largest number of iterations of each.

    Returns:
        (n, 3) poses, and (n, 3, 3) sums of the weighted outer products of the residuals'
        gradients there: the information for residuals of unit variance.
    """
    poses = starts.copy()
    information = np.zeros((starts.shape[0], 3, 3))
    scale = 1.0 / resolution
    h, g = np.empty((3, 3)), np.empty(3)
    for n in range(starts.shape[0]):
        pose = poses[n]
        for turn in range(deviations.shape[0]):
            for _ in range(rounds):
                h[:] = 0.0
                g[:] = 0.0
                c, s = cos(pose[2]), sin(pose[2])
                for j in range(points.shape[0]):
                    x = c * points[j, 0] - s * points[j, 1]
                    y = s * points[j, 0] + c * points[j, 1]
                    u = (pose[0] + x - origin_x) * scale
                    v = (pose[1] + y - origin_y) * scale
                    error = _distance(field, u, v)
                    gx = (_distance(field, u + 0.5, v) - _distance(field, u - 0.5, v)) * scale
                    gy = (_distance(field, u, v + 0.5) - _distance(field, u, v - 0.5)) * scale
                    gh = gy * x - gx * y
                    weight = 1.0 / (1.0 + (error / deviations[turn]) ** 2) ** 2
                    h[0, 0] += weight * gx * gx
                    h[0, 1] += weight * gx * gy
                    h[0, 2] += weight * gx * gh
                    h[1, 1] += weight * gy * gy
                    h[1, 2] += weight * gy * gh
                    h[2, 2] += weight * gh * gh
                    g[0] -= weight * gx * error
                    g[1] -= weight * gy * error
                    g[2] -= weight * gh * error
                step = _solve(h, g)
                for i in range(3):
                    pose[i] += step[i]
                if abs(step[0]) + abs(step[1]) + abs(step[2]) < 1e-4:
                    break
        for i in range(3):
            for j in range(3):
                information[n, i, j] = h[min(i, j), max(i, j)]
    return poses, information


@njit(cache=True, nogil=True)
def _solve(h: FloatArray, g: FloatArray) -> FloatArray:
    """Solve a symmetric positive semidefinite 3x3 system (upper triangle) by damped Cholesky."""
    a = (h[0, 0] + 1e-6) ** 0.5
    b, d = h[0, 1] / a, h[0, 2] / a
    c = max(h[1, 1] + 1e-6 - b * b, 1e-6) ** 0.5
    e = (h[1, 2] - b * d) / c
    f = max(h[2, 2] + 1e-6 - d * d - e * e, 1e-6) ** 0.5
    p = g[0] / a
    q = (g[1] - b * p) / c
    r = (g[2] - d * p - e * q) / f
    solution = np.empty(3)
    solution[2] = r / f
    solution[1] = (q - e * solution[2]) / c
    solution[0] = (p - b * solution[1] - d * solution[2]) / a
    return solution


SEARCH = (
    (
        search_lattice,
        (u1[::1], i8[:, ::1], u1[::1], i4[:, :, ::1], i8[::1], i8, f8, f8, i8, i8, i8, i8),
    ),
    (align, (f4[:, ::1], f8, f8, f8, f8[:, ::1], f8[:, ::1], f8[::1], i8)),
)
"""Entry points, with the types that the search calls them with."""
