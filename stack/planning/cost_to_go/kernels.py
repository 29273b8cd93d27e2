# mypy: allow-untyped-defs, allow-untyped-calls
"""Compiled Dijkstra search of a costmap from the goal."""

import numpy as np
from numba import f8, i8, types, u1

from stack.kernel_cache import njit

UNREACHED = 3.0e38
"""Cost to go of cells from which the goal cannot be reached."""

CHECKED = 1024  # expansions between two checks of the cancel flag


@njit(cache=True, nogil=True)
def cost_to_go(cells, traverse, diagonal, goal, start, margin, scale, cancelled):
    """Cheapest 8-connected cost from each cell to the goal (Dijkstra 1959 with Dial's buckets).

    Args:
        cells: (rows, columns) uint8.
        traverse: (256,) int64 cost of a straight step by cell cost; 0 if impassable.
        diagonal: (256,) likewise.
        goal: (row, column).
        start: (row, column) after which the search may stop.
        margin: share of the start's cost that the search covers beyond the start.
        scale: value of one unit of `traverse` in the result.
        cancelled: (1,) uint8; a value other than 0, set by another thread, ends the search early.

    Returns:
        ((rows, columns) float32, UNREACHED where unreachable or beyond the covered cost; the
        covered cost, UNREACHED if the field is complete).
    """
    rows, columns = cells.shape
    reached = np.full(rows * columns, np.int64(1) << 60)
    mask = 1
    while mask <= diagonal.max():
        mask *= 2
    heads = np.full(mask, -1, np.int64)
    mask -= 1
    capacity = 1024
    queue, links = np.empty((capacity, 2), np.int64), np.empty(capacity, np.int64)
    number = goal[0] * columns + goal[1]
    reached[number] = 0
    queue[0, 0], queue[0, 1], links[0], heads[0] = number, 0, -1, 0
    waiting, fresh, spare, level, limit = 1, 1, -1, 0, np.int64(1) << 59
    expanded = 0
    while waiting > 0 and level <= limit:
        entry = heads[level & mask]
        if entry < 0:
            level += 1
            continue
        heads[level & mask] = links[entry]
        cell, so_far = queue[entry, 0], queue[entry, 1]
        links[entry] = spare
        spare = entry
        waiting -= 1
        if reached[cell] != so_far:
            continue
        expanded += 1
        if expanded % CHECKED == 0 and cancelled[0] != 0:
            break
        row, column = cell // columns, cell % columns
        if row == start[0] and column == start[1]:
            limit = int(so_far * (1.0 + margin)) + 200 * traverse[0]
        here, here_diagonal = traverse[cells[row, column]], diagonal[cells[row, column]]
        for rise in range(-1, 2):
            for run in range(-1, 2):
                near_row, near_column = row + rise, column + run
                if not (0 <= near_row < rows and 0 <= near_column < columns):
                    continue
                if traverse[cells[near_row, near_column]] == 0 or (rise == 0 and run == 0):
                    continue
                cost = so_far + (here_diagonal if rise != 0 and run != 0 else here)
                near = near_row * columns + near_column
                if cost >= reached[near]:
                    continue
                reached[near] = cost
                if spare >= 0:
                    slot = spare
                    spare = links[slot]
                else:
                    if fresh == capacity:
                        capacity *= 2
                        longer_queue = np.empty((capacity, 2), np.int64)
                        longer_links = np.empty(capacity, np.int64)
                        longer_queue[:fresh], longer_links[:fresh] = queue, links
                        queue, links = longer_queue, longer_links
                    slot = fresh
                    fresh += 1
                queue[slot, 0], queue[slot, 1] = near, cost
                links[slot] = heads[cost & mask]
                heads[cost & mask] = slot
                waiting += 1
    complete = UNREACHED if waiting == 0 else scale * level
    field = np.full((rows, columns), np.float32(UNREACHED), np.float32)
    if cancelled[0] != 0:
        return field, complete
    for cell in range(rows * columns):
        if reached[cell] < np.int64(1) << 59:
            field[cell // columns, cell % columns] = scale * reached[cell]
    return field, complete


COST_TO_GO = (
    (
        cost_to_go,
        (u1[:, ::1], i8[::1], i8[::1], *2 * (types.UniTuple(i8, 2),), f8, f8, u1[::1]),
    ),
)
"""Entry point, with the types that planners of poses call it with."""
