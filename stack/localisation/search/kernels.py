"""Compiled loops of the search: branch and bound over a grid of scores, and scan alignment.

Grids are (rows, columns) with row 0 at the smallest y. Poses are rows of x, y, heading. Points are
(m, 2) in the base frame, metres.
"""

from __future__ import annotations

from math import ceil

import numpy as np
from numba import f4, f8, i4, i8, u1
from numpy.typing import NDArray

from stack.kernel_cache import njit
from stack.localisation.kernels import PLACEMENT, Floats, Placement, add_residuals, solve
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
    cells: Bytes, layout: Integers, box: Offsets, offsets: Offsets, flat: Offsets, extents: Offsets,
    least: int,
) -> int:  # fmt: skip
    """Upper bound of the scores in a box; -1 if it is below `least`.

    A box begins at a multiple of its side and so of its stride: an entry's index is the sum of the
    box's and of the point's, `flat`.
    """
    level, heading, row, column = box[0], box[1], box[2], box[3]
    shift, pad, start = layout[level, SHIFT], layout[level, PAD], layout[level, START]
    rows, columns = layout[level, ROWS], layout[level, COLUMNS]
    total, count = 0, offsets.shape[1]
    i, j = (row >> shift) + pad, (column >> shift) + pad
    if (
        i + (extents[heading, 0] >> shift) >= 0
        and j + (extents[heading, 2] >> shift) >= 0
        and i + (extents[heading, 1] >> shift) < rows
        and j + (extents[heading, 3] >> shift) < columns
    ):
        first = start + i * columns + j
        for k in range(count):
            total += cells[np.uint64(first + flat[level, heading, k])]
    else:
        for k in range(count):
            u = i + (offsets[heading, k, 0] >> shift)
            v = j + (offsets[heading, k, 1] >> shift)
            if u >= 0 and v >= 0 and u < rows and v < columns:
                total += cells[start + u * columns + v]
    return total if total >= least else -1


@njit(cache=True, nogil=True)
def search_lattice(
    cells: Bytes, layout: Integers, allowed: Bytes, offsets: Offsets, flat: Offsets,
    extents: Offsets, window: Integers, least: int, fraction: float, separation: float,
    heading_separation: int, period: int, most: int, limit: int,
) -> tuple[Integers, int, bool]:  # fmt: skip
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
        flat: (levels, h, m) differences of the indices of their entries.
        extents: (h, 4) smallest and largest row, smallest and largest column of the offsets.
        window: (4,) first row, first column, rows, columns of the lattice.
        least: smallest score of a result, at least 1.
        fraction: of the best score, smallest of a result.
        separation: cells; poses nearer than this with a similar heading are not distinct.
        heading_separation: number of headings from which on poses are distinct.
        period: number of headings in a full turn; larger than any difference if they are no turn.
        most: number of results at which the search ends.
        limit: number of boxes at which the search ends.

    Returns:
        (most, 4) score, heading, row, column, best first; the number of results; and whether the
        search did not end at `limit`.
    """
    headings, count = offsets.shape[0], offsets.shape[1]
    top = layout.shape[0] - 1
    heads = np.full(count * HIGHEST + 1, -1)
    boxes, following = np.empty((4096, 4), dtype=np.int32), np.empty(4096, dtype=np.int64)
    used, spare, examined, found, threshold = 0, -1, 0, 0, max(least, 1)
    results, leaves = np.zeros((most, 4), dtype=np.int64), np.empty(256, dtype=np.int64)
    end_row, end_column = window[0] + window[2], window[1] + window[3]
    side, place = 1 << top, np.zeros(4, dtype=np.int32)
    for heading in range(headings):
        for row in range(window[0] // side * side, end_row, side):
            for column in range(window[1] // side * side, end_column, side):
                if _value(allowed, layout, top, row, column) == 0:
                    continue
                if used == boxes.shape[0]:
                    boxes, following = _longer_rows(boxes), _longer(following)
                boxes[used, 0], boxes[used, 1] = top, heading
                boxes[used, 2], boxes[used, 3] = row, column
                examined += 1
                score = _bound(cells, layout, boxes[used], offsets, flat, extents, threshold)
                if score >= 0:
                    following[used] = heads[score]
                    heads[score] = used
                    used += 1
    for score in range(heads.shape[0] - 1, 0, -1):
        if score < threshold:
            break
        leaf_count = 0
        while heads[score] >= 0:
            box = heads[score]
            heads[score] = following[box]
            level, heading = boxes[box, 0], boxes[box, 1]
            row, column = boxes[box, 2], boxes[box, 3]
            following[box], spare = spare, box
            if _is_taken(results, found, boxes[box], separation, heading_separation, period):
                continue
            if level == 0:
                if leaf_count == leaves.shape[0]:
                    leaves = _longer(leaves)
                leaves[leaf_count] = (
                    (heading * window[2] + row - window[0]) * window[3] + column - window[1]
                )
                leaf_count += 1
                continue
            if examined >= limit:
                return results, found, False
            half = 1 << (level - 1)
            for child in range(4):
                r, c = row + half * (child >> 1), column + half * (child & 1)
                if (
                    r >= end_row
                    or c >= end_column
                    or r + half <= window[0]
                    or c + half <= window[1]
                ):
                    continue
                if _value(allowed, layout, level - 1, r, c) == 0:
                    continue
                free = spare if spare >= 0 else used
                if free == boxes.shape[0]:
                    boxes, following = _longer_rows(boxes), _longer(following)
                boxes[free, 0], boxes[free, 1] = level - 1, heading
                boxes[free, 2], boxes[free, 3] = r, c
                examined += 1
                bound = _bound(cells, layout, boxes[free], offsets, flat, extents, threshold)
                if bound < 0:
                    continue
                if free == spare:
                    spare = following[free]
                else:
                    used += 1
                following[free] = heads[bound]
                heads[bound] = free
        _sort(leaves, leaf_count)
        for k in range(leaf_count):
            rest = leaves[k] // window[3]
            place[0], place[1] = 0, rest // window[2]
            place[2] = rest % window[2] + window[0]
            place[3] = leaves[k] % window[3] + window[1]
            if _is_taken(results, found, place, separation, heading_separation, period):
                continue
            results[found, 0], results[found, 1] = score, place[1]
            results[found, 2], results[found, 3] = place[2], place[3]
            found += 1
            if found == 1:
                threshold = max(threshold, ceil(fraction * score))
            if found == most:
                return results, found, True
    return results, found, True


@njit(cache=True, nogil=True)
def _longer(values: Integers) -> Integers:
    """Return a copy of twice the length."""
    longer = np.empty(2 * values.shape[0], dtype=np.int64)
    for k in range(values.shape[0]):
        longer[k] = values[k]
    return longer


@njit(cache=True, nogil=True)
def _longer_rows(boxes: Offsets) -> Offsets:
    """Return a copy with twice as many rows."""
    longer = np.empty((2 * boxes.shape[0], 4), dtype=np.int32)
    for k in range(boxes.shape[0]):
        for i in range(4):
            longer[k, i] = boxes[k, i]
    return longer


@njit(cache=True, nogil=True)
def _sort(values: Integers, count: int) -> None:
    """Sort the first `count` values in place, by Shell's method; np.sort takes long to compile."""
    gap = 1
    while gap < count:
        gap = 3 * gap + 1
    while gap >= 1:
        for i in range(gap, count):
            value, j = values[i], i
            while j >= gap and values[j - gap] > value:
                values[j] = values[j - gap]
                j -= gap
            values[j] = value
        gap //= 3


@njit(cache=True, nogil=True)
def _is_taken(
    results: Integers, found: int, box: Offsets, separation: float, heading_separation: int,
    period: int,
) -> bool:  # fmt: skip
    """Whether one result is not distinct from any pose of a box (level, heading, row, column)."""
    level, heading, row, column = box[0], box[1], box[2], box[3]
    last = (1 << level) - 1
    for k in range(found):
        turned = abs(results[k, 1] - heading)
        if min(turned, abs(period - turned)) >= heading_separation:
            continue
        off_row = max(abs(results[k, 2] - row), abs(results[k, 2] - row - last))
        off_column = max(abs(results[k, 3] - column), abs(results[k, 3] - column - last))
        if off_row * off_row + off_column * off_column < separation * separation:
            return True
    return False


@njit(cache=True, nogil=True)
def align(
    field: Floats, placement: Placement, starts: FloatArray, points: FloatArray,
    deviations: FloatArray, rounds: int,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Align points with the map's surfaces by Gauss-Newton; see `add_residuals`.

    Args:
        field: signed distance to the nearest surface, metres.
        placement: of the field.
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
    h, g = np.empty((3, 3)), np.empty(3)
    for n in range(starts.shape[0]):
        pose = poses[n]
        for turn in range(deviations.shape[0]):
            for _ in range(rounds):
                h[:] = 0.0
                g[:] = 0.0
                add_residuals(field, placement, pose, points, deviations[turn], h, g)
                step = solve(h, g, 1e-6, 1e-6)
                for i in range(3):
                    pose[i] += step[i]
                if abs(step[0]) + abs(step[1]) + abs(step[2]) < 1e-4:
                    break
        for i in range(3):
            for j in range(3):
                information[n, i, j] = h[min(i, j), max(i, j)]
    return poses, information


@njit(cache=True, nogil=True)
def refine_pose(
    field: Floats, placement: Placement, start: FloatArray, information: FloatArray,
    points: FloatArray, deviation: float,
) -> FloatArray:  # fmt: skip
    """Align points with the map's surfaces by Gauss-Newton, with a prior; see `add_residuals`.

    Args:
        field: signed distance to the nearest surface, metres.
        placement: of the field.
        start: (3,) prior mean.
        information: (3, 3) inverse covariance of the prior, divided by that of a point.
        points: (m, 2) in the base frame.
        deviation: residual in metres whose weight is a quarter.

    Returns:
        (3,) pose.
    """
    pose = start.copy()
    for _ in range(6):
        h = information.copy()
        # Written out: numba's matrix product would need SciPy.
        back = start - pose
        g = information[:, 0] * back[0] + information[:, 1] * back[1] + information[:, 2] * back[2]
        add_residuals(field, placement, pose, points, deviation, h, g)
        step = solve(h, g, 1e-9, 0.0)
        pose += step
        if abs(step[0]) + abs(step[1]) + abs(step[2]) < 1e-5:
            break
    return pose


SEARCH = (
    (
        search_lattice,
        (
            u1[::1], i8[:, ::1], u1[::1], i4[:, :, ::1], i4[:, :, ::1], i4[:, ::1], i8[::1], i8,
            f8, f8, i8, i8, i8, i8,
        ),
    ),
    (refine_pose, (f4[:, ::1], PLACEMENT, f8[::1], f8[:, ::1], f8[:, ::1], f8)),
    (align, (f4[:, ::1], PLACEMENT, f8[:, ::1], f8[:, ::1], f8[::1], i8)),
)  # fmt: skip
"""Entry points, with the types that the search calls them with."""
