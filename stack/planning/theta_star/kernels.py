# mypy: allow-untyped-defs
"""Compiled loops of the any-angle search.

`weights` (256,) float64 says by cell cost what a cell's length of line through it counts, 0 for no
way. Places are middles of cells, lengths are in cells; cells are numbered row * columns + column.

The heap stands in kinematic/kernels.py as well: a kernel's cache does not notice when what it calls
in another module was changed.
"""

import numpy as np
from numba import njit

NOT_REACHED = 1.0e300
FOUND, NO_WAY, LIMIT, STOPPED = 0, 1, 2, 3
CHECKED = 1024  # expansions between two looks at the wish to stop


@njit(cache=True, nogil=True)
def line_cost(cells, weights, row, column, end_row, end_column, budget):
    """What the straight line between the middles of two cells counts.

    Every cell is weighed by the exact length of line in it (Amanatides and Woo 1987). A line
    through a corner of cells needs a way through both cells beside it.

    Returns:
        The cost, or infinity without a way or where it would exceed the budget.
    """
    rise, run = abs(end_row - row), abs(end_column - column)
    length = np.hypot(float(rise), float(run))
    row_step, column_step = (1 if end_row > row else -1), (1 if end_column > column else -1)
    # border k is crossed at (2 k + 1) / (2 n) of the line: in whole numbers, so that corners count
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
def _push(heap, count, f, cell):
    """Add an entry to a binary heap ordered by f, then by cell."""
    at = count
    while at > 0:
        above = (at - 1) // 2
        if heap[above, 0] < f or (heap[above, 0] == f and heap[above, 1] <= cell):
            break
        heap[at] = heap[above]
        at = above
    heap[at, 0], heap[at, 1] = f, cell


@njit(cache=True, nogil=True)
def _pop(heap, count):
    """Take the first entry off the heap of `count` entries: (f, cell)."""
    f, cell = heap[0, 0], heap[0, 1]
    last_f, last_cell = heap[count - 1, 0], heap[count - 1, 1]
    count -= 1
    at = 0
    while True:
        below = 2 * at + 1
        if below >= count:
            break
        if below + 1 < count and (
            heap[below + 1, 0] < heap[below, 0]
            or (heap[below + 1, 0] == heap[below, 0] and heap[below + 1, 1] < heap[below, 1])
        ):
            below += 1
        if last_f < heap[below, 0] or (last_f == heap[below, 0] and last_cell <= heap[below, 1]):
            break
        heap[at] = heap[below]
        at = below
    heap[at, 0], heap[at, 1] = last_f, last_cell
    return f, np.int64(cell)


@njit(cache=True, nogil=True)
def _may_step(cells, weights, row, column, rise, run):
    """Whether a neighbour can be entered: on the grid, a way, no corner cut."""
    rows, columns = cells.shape
    near_row, near_column = row + rise, column + run
    if not (0 <= near_row < rows and 0 <= near_column < columns):
        return False
    if weights[cells[near_row, near_column]] == 0.0 or (rise == 0 and run == 0):
        return False
    if rise == 0 or run == 0:
        return True
    return weights[cells[row, near_column]] > 0.0 and weights[cells[near_row, column]] > 0.0


@njit(cache=True, nogil=True)
def _step_cost(cells, weights, row, column, rise, run):
    """Cost of the line to a neighbour that may be entered."""
    mean = weights[cells[row, column]] + weights[cells[row + rise, column + run]]
    return 0.5 * mean * np.hypot(float(rise), float(run))


@njit(cache=True, nogil=True)
def _straight_from(cells, weights, costs, parents, cell):
    """Join a cell to the parent of its neighbour where the straight line from there is cheaper."""
    columns = cells.shape[1]
    parent = parents[parents[cell]]
    if parent == parents[cell]:
        return
    line = line_cost(
        cells, weights, parent // columns, parent % columns, cell // columns, cell % columns,
        costs[cell] - costs[parent],
    )  # fmt: skip
    if costs[parent] + line <= costs[cell]:
        costs[cell], parents[cell] = costs[parent] + line, parent


@njit(cache=True, nogil=True)
def search(
    cells, weights, least, costs, parents, closed, start, goal, most, stop,
):  # fmt: skip
    """Lazy Theta* (Nash, Koenig and Tovey 2010) where cells have costs.

    Lazy: a cell waits at what it costs by way of its neighbour; the line from that neighbour's
    parent is measured once, when the cell comes up, and taken where it is cheaper. Since a cell
    never waits at more than the cheapest path of steps to it, none found is dearer than that.

    Args:
        cells: (rows, columns) uint8.
        weights: (256,).
        least: the smallest weight above 0.
        costs: (n,) float64 cost so far, filled with NOT_REACHED.
        parents: (n,) int32; valid where closed.
        closed: (n,) bool, all False.
        start: cell number.
        goal: cell number.
        most: expansions after which to give up with LIMIT.
        stop: (1,) uint8, set to anything but 0 by another thread to have it STOPPED.

    Returns:
        (status, cells expanded).
    """
    columns = cells.shape[1]
    goal_row, goal_column = goal // columns, goal % columns
    capacity = 4096
    heap = np.empty((capacity, 2))
    costs[start], parents[start] = 0.0, start
    _push(heap, 0, 0.0, start)
    waiting, expanded = 1, 0
    while waiting > 0:
        _, cell = _pop(heap, waiting)
        waiting -= 1
        if closed[cell]:
            continue
        if expanded >= most:
            return LIMIT, expanded
        if expanded % CHECKED == 0 and stop[0] != 0:
            return STOPPED, expanded
        _straight_from(cells, weights, costs, parents, cell)
        closed[cell] = True
        expanded += 1
        if cell == goal:
            return FOUND, expanded
        if waiting + 8 >= capacity:
            capacity *= 2
            longer = np.empty((capacity, 2))
            longer[:waiting] = heap[:waiting]
            heap = longer
        row, column = cell // columns, cell % columns
        for rise in range(-1, 2):
            for run in range(-1, 2):
                if not _may_step(cells, weights, row, column, rise, run):
                    continue
                near_row, near_column = row + rise, column + run
                near = near_row * columns + near_column
                cost = costs[cell] + _step_cost(cells, weights, row, column, rise, run)
                if closed[near] or cost >= costs[near]:
                    continue
                costs[near], parents[near] = cost, cell
                to_go = least * np.hypot(near_row - goal_row, near_column - goal_column)
                _push(heap, waiting, cost + to_go, near)
                waiting += 1
    return NO_WAY, expanded


@njit(cache=True, nogil=True)
def nearest_closed(closed, columns, row, column):
    """Number of the reached cell nearest to a place in fractions of cells; -1 for none."""
    best, found = np.inf, -1
    for cell in range(closed.size):
        if closed[cell]:
            rise, run = cell // columns + 0.5 - row, cell % columns + 0.5 - column
            square = rise * rise + run * run
            if square < best:
                best, found = square, cell
    return found
