# mypy: allow-untyped-defs
"""Compiled loops of the any-angle search.

`weights` (256,) float64 says by cell cost what a cell's length of line through it counts, 0 for no
way. Places are middles of cells, lengths are in cells; cells are numbered row * columns + column.
"""

import numpy as np
from numba import njit

NOT_REACHED = 1.0e300
SLACK = 1e-9


@njit(cache=True, nogil=True)
def line_cost(cells, weights, row, column, end_row, end_column, budget):
    """What the straight line between the middles of two cells counts.

    Every cell is weighed by the exact length of line in it (Amanatides and Woo 1987). A line
    through a corner of cells needs a way through both cells beside it.

    Returns:
        The cost, or infinity without a way or where it would exceed the budget.
    """
    rise, run = end_row - row, end_column - column
    length = np.hypot(rise, run)
    row_step, column_step = (1 if rise > 0 else -1), (1 if run > 0 else -1)
    rise, run = abs(rise), abs(run)
    weight = weights[cells[row, column]]
    if weight == 0.0:
        return np.inf
    total, travelled = 0.0, 0.0
    crossed_rows, crossed_columns = 0, 0
    while crossed_rows < rise or crossed_columns < run:
        # the next border is crossed at (2 k + 1) / (2 n) of the line: compared in whole numbers
        to_row = (2 * crossed_rows + 1) * run if crossed_rows < rise else np.int64(1) << 60
        to_column = (2 * crossed_columns + 1) * rise if crossed_columns < run else np.int64(1) << 60
        if rise == 0:
            share = (2 * crossed_columns + 1) / (2.0 * run)
        elif run == 0:
            share = (2 * crossed_rows + 1) / (2.0 * rise)
        else:
            share = min(to_row, to_column) / (2.0 * rise * run)
        total += weight * (share - travelled) * length
        travelled = share
        if total > budget:
            return np.inf
        if to_row == to_column:
            beside, above = cells[row, column + column_step], cells[row + row_step, column]
            if weights[beside] == 0.0 or weights[above] == 0.0:
                return np.inf
        if to_row <= to_column:
            row += row_step
            crossed_rows += 1
        if to_column <= to_row:
            column += column_step
            crossed_columns += 1
        weight = weights[cells[row, column]]
        if weight == 0.0:
            return np.inf
    total += weight * (1.0 - travelled) * length
    return total if total <= budget else np.inf


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
def search(cells, weights, least, costs, parents, checked, closed, start, goal):
    """Lazy Theta* (Nash, Koenig and Tovey 2010) where cells have costs.

    A cell is offered its neighbour's parent at the least that the straight line from it could
    cost; what the line costs is found out when the cell comes up. Where it is blocked, or dearer
    than the way by the best neighbour, the cell takes that neighbour for its parent. A cell that
    turns out dearer than it was offered goes back in the queue.

    Args:
        cells: (rows, columns) uint8.
        weights: (256,).
        least: the smallest weight above 0.
        costs: (n,) float64 cost so far, filled with NOT_REACHED.
        parents: (n,) int64; valid where closed.
        checked: (n,) int64 parent whose line was measured last, filled with -1.
        closed: (n,) bool, all False.
        start: cell number.
        goal: cell number; -1 reaches every cell that can be.

    Returns:
        (whether the goal was reached, cells expanded).
    """
    columns = cells.shape[1]
    goal_row, goal_column = (goal // columns, goal % columns) if goal >= 0 else (0, 0)
    heavy = least if goal >= 0 else 0.0
    capacity = 4096
    heap = np.empty((capacity, 2))
    costs[start], parents[start], checked[start] = 0.0, start, start
    distance = np.hypot(start // columns - goal_row, start % columns - goal_column)
    _push(heap, 0, heavy * distance, start)
    waiting, expanded = 1, 0
    while waiting > 0:
        f, cell = _pop(heap, waiting)
        waiting -= 1
        if closed[cell]:
            continue
        row, column = cell // columns, cell % columns
        to_go = heavy * np.hypot(row - goal_row, column - goal_column)
        if f > costs[cell] + to_go + SLACK:
            continue  # a better offer was made after this entry
        if checked[cell] != parents[cell]:
            best, best_parent = NOT_REACHED, cell
            for rise in range(-1, 2):
                for run in range(-1, 2):
                    if not _may_step(cells, weights, row, column, rise, run):
                        continue
                    near = (row + rise) * columns + column + run
                    if not closed[near]:
                        continue
                    cost = costs[near] + _step_cost(cells, weights, row, column, rise, run)
                    if cost < best:
                        best, best_parent = cost, near
            parent = parents[cell]
            line = line_cost(
                cells, weights, parent // columns, parent % columns, row, column,
                best - costs[parent] + SLACK,
            )  # fmt: skip
            checked[cell] = parent
            if costs[parent] + line <= best:
                best, best_parent = costs[parent] + line, parent
            worse = best > costs[cell] + SLACK
            costs[cell], parents[cell], checked[cell] = best, best_parent, best_parent
            if worse:
                _push(heap, waiting, best + to_go, cell)
                waiting += 1
                continue
        closed[cell] = True
        expanded += 1
        if cell == goal:
            return True, expanded
        if waiting + 16 >= capacity:
            capacity *= 2
            longer = np.empty((capacity, 2))
            longer[:waiting] = heap[:waiting]
            heap = longer
        parent = parents[cell]
        parent_row, parent_column = parent // columns, parent % columns
        for rise in range(-1, 2):
            for run in range(-1, 2):
                if not _may_step(cells, weights, row, column, rise, run):
                    continue
                near_row, near_column = row + rise, column + run
                near = near_row * columns + near_column
                if closed[near]:
                    continue
                stepped = costs[cell] + _step_cost(cells, weights, row, column, rise, run)
                offer, offered = stepped, cell
                exact = True
                if parent != cell:
                    line = least * np.hypot(near_row - parent_row, near_column - parent_column)
                    if costs[parent] + line < stepped:
                        offer, offered, exact = costs[parent] + line, parent, False
                if offer >= costs[near] - SLACK:
                    continue
                costs[near], parents[near] = offer, offered
                checked[near] = offered if exact else -1
                away = heavy * np.hypot(near_row - goal_row, near_column - goal_column)
                _push(heap, waiting, offer + away, near)
                waiting += 1
    return False, expanded


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
