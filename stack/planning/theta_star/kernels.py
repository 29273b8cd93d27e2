# mypy: allow-untyped-defs
"""Compiled loops of the any-angle search.

`weights` (256,) float64 is the cost of one cell length of line, by cell cost, 0 if impassable.
Positions are cell centres, lengths are in cells; the index of a cell is row * columns + column.
"""

import numpy as np
from numba import b1, f8, i4, i8, u1

from stack.kernel_cache import njit
from stack.planning.kernels import pop, push

NOT_REACHED = 1.0e300
FOUND, NO_PATH, LIMIT, STOPPED = 0, 1, 2, 3
CHECKED = 1024  # expansions between two checks of the cancel flag
BUCKETS_PER_STEP = 32.0  # buckets of the queue per cost of a step over free cells
CAPACITY = 1024  # initial entries of the queue
DIAGONAL = 2.0**0.5

# Row and column steps to the neighbours: right, up, left, down, then the diagonals between them.
# SIDES is the bit mask of the two straight neighbours of a diagonal.
ROW_STEP = np.array([0, 1, 0, -1, 1, 1, -1, -1])
COLUMN_STEP = np.array([1, 0, -1, 0, 1, -1, -1, 1])
SIDES = np.array([0, 0, 0, 0, 0b0011, 0b0110, 0b1100, 0b1001])


@njit(cache=True, nogil=True)
def line_cost(cells, weights, row, column, end_row, end_column, budget):
    """Cost of the straight line between the centres of two cells.

    Each cell is weighted by the exact length of the line in it (Amanatides and Woo 1987). A line
    through a cell corner needs both adjacent cells to be passable.

    Returns:
        The cost, or infinity if the line is blocked or would exceed the budget.
    """
    rise, run = abs(end_row - row), abs(end_column - column)
    length = np.hypot(float(rise), float(run))
    row_step, column_step = (1 if end_row > row else -1), (1 if end_column > column else -1)
    # Border k is crossed at (2 k + 1) / (2 n) of the line. Integers detect corners exactly.
    never = 1 << 60
    whole = 2 * max(rise, 1) * max(run, 1)
    row_gap, column_gap = 2 * max(run, 1), 2 * max(rise, 1)
    to_row = row_gap // 2 if rise > 0 else never
    to_column = column_gap // 2 if run > 0 else never
    scale = length / whole
    weight = weights[cells[row, column]]
    least = weights[0]
    total, travelled = 0.0, 0
    for _ in range(rise + run):
        border = min(to_row, to_column)
        if border >= whole:
            break
        total += weight * scale * (border - travelled)
        travelled = border
        if weight == 0.0 or total + least * scale * (whole - border) > budget:
            return np.inf
        if to_row == to_column:
            beside, above = cells[row, column + column_step], cells[row + row_step, column]
            if weights[beside] == 0.0 or weights[above] == 0.0:
                return np.inf
            row += row_step
            column += column_step
            to_row += row_gap
            to_column += column_gap
        elif to_row < to_column:
            row += row_step
            to_row += row_gap
        else:
            column += column_step
            to_column += column_gap
        weight = weights[cells[row, column]]
    total += weight * scale * (whole - travelled)
    return total if weight > 0.0 and total <= budget else np.inf


@njit(cache=True, nogil=True)
def _straight_from(cells, weights, costs, parents, cell, row, column):
    """Replace a cell's parent by its grandparent if the straight line from there is cheaper."""
    columns = cells.shape[1]
    parent = parents[parents[cell]]
    if parent == parents[cell]:
        return
    parent_row = parent // columns
    line = line_cost(
        cells, weights, parent_row, parent - parent_row * columns, row, column,
        costs[cell] - costs[parent],
    )  # fmt: skip
    if costs[parent] + line <= costs[cell]:
        costs[cell], parents[cell] = costs[parent] + line, parent


@njit(cache=True, nogil=True)
def _longer(values, used):
    """Return an array of twice the length with the first `used` values."""
    longer = np.empty((2 * values.shape[0], *values.shape[1:]), values.dtype)
    longer[:used] = values[:used]
    return longer


@njit(cache=True, nogil=True)
def search(
    cells, weights, least, costs, parents, closed, start, goal, max_expansions, cancelled,
):  # fmt: skip
    """Lazy Theta* (Nash, Koenig and Tovey 2010) on cells with costs.

    A cell is queued with its cost through the neighbour that reached it. The line from that
    neighbour's parent is evaluated once, when the cell is popped, and used if it is cheaper. A
    queued cost is never above that of the cheapest path of steps, so neither is the result.

    Cells wait in buckets by f (Dial 1969); only those of the current bucket are in a heap, so it is
    small. Cells are popped in the order of one heap of all.

    Args:
        cells: (rows, columns) uint8.
        weights: (256,) see the module docstring.
        least: the smallest weight above 0.
        costs: (n,) float64 cost so far, filled with NOT_REACHED.
        parents: (n,) int32; valid where closed.
        closed: (n,) bool, all False.
        start: cell index.
        goal: cell index.
        max_expansions: number of expansions after which the search ends with LIMIT.
        cancelled: (1,) uint8; a value other than 0, set by another thread, ends it with STOPPED.

    Returns:
        (status, number of cells expanded).
    """
    rows, columns = cells.shape
    flat = cells.reshape(-1)
    goal_row, goal_column = goal // columns, goal % columns
    per_f = BUCKETS_PER_STEP / least
    jump = DIAGONAL * (weights.max() + least) * per_f + 2.0  # largest increase of f in one step
    mask = (1 << int(np.ceil(np.log2(jump)))) - 1
    heads = np.full(mask + 1, -1, np.int32)
    waiting_f, waiting_cells = np.empty(CAPACITY), np.empty(CAPACITY, np.int32)
    links = np.empty(CAPACITY, np.int32)
    heap = np.empty((CAPACITY, 2))
    fresh, spare, waiting, in_heap, expanded = 0, -1, 0, 1, 0
    costs[start], parents[start] = 0.0, start
    rise, run = start // columns - goal_row, start % columns - goal_column
    first_f = least * np.sqrt(float(rise * rise + run * run))
    level = 0
    push(heap, 0, first_f, start)
    while in_heap > 0 or waiting > 0:
        if in_heap == 0:
            level += 1
            entry = heads[level & mask]
            heads[level & mask] = -1
            while entry >= 0:
                if not closed[waiting_cells[entry]]:
                    if in_heap == heap.shape[0]:
                        heap = _longer(heap, in_heap)
                    push(heap, in_heap, waiting_f[entry], waiting_cells[entry])
                    in_heap += 1
                waiting -= 1
                after = links[entry]
                links[entry] = spare
                spare, entry = entry, after
            continue
        _, cell = pop(heap, in_heap)
        in_heap -= 1
        if closed[cell]:
            continue
        if expanded >= max_expansions:
            return LIMIT, expanded
        if expanded % CHECKED == 0 and cancelled[0] != 0:
            return STOPPED, expanded
        row = cell // columns
        column = cell - row * columns
        _straight_from(cells, weights, costs, parents, cell, row, column)
        closed[cell] = True
        expanded += 1
        if cell == goal:
            return FOUND, expanded
        inner = 0 < row < rows - 1 and 0 < column < columns - 1
        here, so_far, passable = weights[flat[cell]], costs[cell], 0
        for direction in range(8):
            near_row, near_column = row + ROW_STEP[direction], column + COLUMN_STEP[direction]
            if not (inner or (0 <= near_row < rows and 0 <= near_column < columns)):
                continue
            near = near_row * columns + near_column
            weight = weights[flat[near]]
            if weight == 0.0:
                continue
            if direction < 4:
                passable |= 1 << direction
                cost = so_far + 0.5 * (here + weight)
            elif (passable & SIDES[direction]) == SIDES[direction]:
                cost = so_far + 0.5 * DIAGONAL * (here + weight)
            else:
                continue
            if cost >= costs[near] or closed[near]:
                continue
            costs[near], parents[near] = cost, cell
            rise, run = near_row - goal_row, near_column - goal_column
            f = cost + least * np.sqrt(float(rise * rise + run * run))
            bucket = int((f - first_f) * per_f)
            if bucket <= level:
                if in_heap == heap.shape[0]:
                    heap = _longer(heap, in_heap)
                push(heap, in_heap, f, near)
                in_heap += 1
                continue
            if spare >= 0:
                slot = spare
                spare = links[slot]
            else:
                if fresh == links.size:
                    links, waiting_f = _longer(links, fresh), _longer(waiting_f, fresh)
                    waiting_cells = _longer(waiting_cells, fresh)
                slot = fresh
                fresh += 1
            waiting_f[slot], waiting_cells[slot] = f, near
            links[slot] = heads[bucket & mask]
            heads[bucket & mask] = slot
            waiting += 1
    return NO_PATH, expanded


SEARCH = ((search, (u1[:, ::1], f8[::1], f8, f8[::1], i4[::1], b1[::1], i8, i8, i8, u1[::1])),)
"""Entry point, with the types that Theta* calls it with."""
