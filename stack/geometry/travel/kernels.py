"""Compiled search of the shortest ways over the cells of a grid."""

from __future__ import annotations

import numpy as np
from numba import i8, u1
from numpy.typing import NDArray

from stack.kernel_cache import njit

STRAIGHT, DIAGONAL = 10, 14
"""Lengths of a step to a neighbour, in tenths of a cell."""
BUCKETS = DIAGONAL + 1
UNREACHED = 1 << 30


@njit(cache=True, nogil=True)
def travel_distances(passable: NDArray[np.uint8], row: int, column: int) -> NDArray[np.int32]:
    """Shortest way from a cell to all others over passable cells, in tenths of a cell.

    Dijkstra's algorithm with a ring of buckets (R. B. Dial, Communications of the ACM 12, 1969).
    Diagonal steps need both cells beside them.

    Args:
        passable: (rows, columns), 1 or 0.
        row: of the start, which counts as passable.
        column: of the start.

    Returns:
        (rows, columns) int32; UNREACHED where there is no way.
    """
    rows, columns = passable.shape
    best = np.full((rows, columns), UNREACHED, np.int32)
    heads = np.full(BUCKETS, -1, np.int64)
    capacity = 1024
    cells = np.empty(capacity, np.int64)
    following = np.empty(capacity, np.int64)
    count = 0
    best[row, column] = 0
    cells[0], following[0], heads[0] = row * columns + column, -1, 0
    count = 1
    distance, empty = 0, 0
    while empty < BUCKETS:
        entry = heads[distance % BUCKETS]
        if entry < 0:
            distance, empty = distance + 1, empty + 1
            continue
        empty = 0
        heads[distance % BUCKETS] = following[entry]
        r, c = cells[entry] // columns, cells[entry] % columns
        if best[r, c] != distance:
            continue
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                y, x = r + dr, c + dc
                if (dr == 0 and dc == 0) or y < 0 or x < 0 or y >= rows or x >= columns:
                    continue
                if passable[y, x] == 0:
                    continue
                step = STRAIGHT
                if dr != 0 and dc != 0:
                    if passable[r, x] == 0 or passable[y, c] == 0:
                        continue
                    step = DIAGONAL
                reached = distance + step
                if reached >= best[y, x]:
                    continue
                best[y, x] = reached
                if count == capacity:
                    more = np.empty(2 * capacity, np.int64)
                    more[:capacity] = cells
                    cells = more
                    others = np.empty(2 * capacity, np.int64)
                    others[:capacity] = following
                    following = others
                    capacity *= 2
                bucket = reached % BUCKETS
                cells[count], following[count] = y * columns + x, heads[bucket]
                heads[bucket] = count
                count += 1
    return best


TRAVEL = ((travel_distances, (u1[:, ::1], i8, i8)),)
"""Entry points with the types that the stack calls them with."""
