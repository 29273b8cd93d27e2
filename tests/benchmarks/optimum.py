# mypy: allow-untyped-defs
"""The cheapest cost on a costmap, computed without anything that planners use."""

import numpy as np
from numba import njit


@njit(cache=True)
def cheapest(weights, row, column):
    """Dijkstra (1959) with a binary heap in floating point, from one cell to all.

    A step costs its length times the weight of the cell it enters; a diagonal one needs both cells
    beside it.

    Args:
        weights: (rows, columns) float32, infinite where there is no way.
        row: of the start.
        column: of the start.

    Returns:
        (rows, columns) float64, infinite where nothing leads.
    """
    rows, columns = weights.shape
    costs = np.full((rows, columns), np.inf)
    costs[row, column] = 0.0
    keys, cells = np.empty(1 << 20), np.empty(1 << 20, np.int64)
    keys[0], cells[0], count = 0.0, row * columns + column, 1
    while count > 0:
        so_far, cell = keys[0], cells[0]
        count -= 1
        _sift_down(keys, cells, count, keys[count], cells[count])
        here_row, here_column = cell // columns, cell % columns
        if so_far > costs[here_row, here_column]:
            continue
        for rise in range(-1, 2):
            for run in range(-1, 2):
                near_row, near_column = here_row + rise, here_column + run
                if not (0 <= near_row < rows and 0 <= near_column < columns):
                    continue
                beside = max(weights[here_row, near_column], weights[near_row, here_column])
                if np.isinf(beside) or np.isinf(weights[near_row, near_column]):
                    continue
                cost = so_far + np.hypot(rise, run) * weights[near_row, near_column]
                if cost >= costs[near_row, near_column]:
                    continue
                costs[near_row, near_column] = cost
                if count == keys.size:
                    keys = np.append(keys, np.empty(keys.size))
                    cells = np.append(cells, np.empty(cells.size, np.int64))
                at = count
                while at > 0 and keys[(at - 1) // 2] > cost:
                    keys[at], cells[at] = keys[(at - 1) // 2], cells[(at - 1) // 2]
                    at = (at - 1) // 2
                keys[at], cells[at] = cost, near_row * columns + near_column
                count += 1
    return costs


@njit(cache=True)
def _sift_down(keys, cells, count, key, cell):
    at = 0
    while 2 * at + 1 < count:
        below = 2 * at + 1
        if below + 1 < count and keys[below + 1] < keys[below]:
            below += 1
        if keys[below] >= key:
            break
        keys[at], cells[at] = keys[below], cells[below]
        at = below
    keys[at], cells[at] = key, cell
