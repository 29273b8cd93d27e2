# mypy: allow-untyped-defs
"""Compiled loops of A* and of path smoothing.

Costs of a step are whole numbers, so that paths are optimal to the last unit and the same on every
machine. `traverse` (256,) int64 gives by cell cost what a straight step into the cell costs, 0 for
no way; `diagonal` the same for a diagonal step. Cells are numbered row * columns + column.

Nothing is cleared between queries: `reached` holds base + cost-so-far, and each query's base lies
so far below the one before that whatever older queries left counts as not reached.
"""

import numpy as np
from numba import njit

# Rows and columns to the neighbours: right, up, left, down, then the diagonals between them; the
# way back along direction k is OPPOSITE[k]. SIDES are the two straight neighbours of a diagonal.
ROW_STEP = np.array([0, 1, 0, -1, 1, 1, -1, -1])
COLUMN_STEP = np.array([1, 0, -1, 0, 1, -1, -1, 1])
SIDES = np.array([0, 0, 0, 0, 0b0011, 0b0110, 0b1100, 0b1001])

AT_REST = 1e-3  # cells; a pull of less is not worth looking up the cells around
FOUND, NO_WAY, QUEUE_FULL, RANGE_FULL, LIMIT, STOPPED = 0, 1, 2, 3, 4, 5
CHECKED = 1024  # expansions between two looks at the wish to stop: at most 0.1 ms


@njit(cache=True, nogil=True)
def _octile(rows, columns, straight, oblique):
    """Cost of the shortest way over free cells."""
    if rows > columns:
        return straight * (rows - columns) + oblique * columns
    return straight * (columns - rows) + oblique * rows


@njit(cache=True, nogil=True)
def search(
    costs, traverse, diagonal, escape, escape_reach,
    reached, parents, base, limit, heads, queue, links, start, goal, most, stop,
):  # fmt: skip
    """A* (Hart, Nilsson and Raphael 1968) with Dial's bucket queue (1969) on f = cost + heuristic.

    The octile heuristic is consistent for these costs, hence f never falls and each cell is
    expanded once. A bucket is a linked stack: of equal f, the deepest entry goes first.

    Args:
        costs: (rows, columns) uint8.
        traverse: (256,) by cell cost, 0 for no way; traverse[0] is the least of the others.
        diagonal: (256,) likewise.
        escape: (256,) what a step into a cell with no way costs while the robot leaves the place
            it started in. It goes up with badness: such cells are entered only from cells at
            least as bad, and never again once a better one was reached.
        escape_reach: cells from the start within which that is allowed; 0 when the start is free.
        reached: (n,) int32, n >= cells; see above.
        parents: (n,) uint8, direction that led into a cell; valid where reached.
        base: this query's zero in `reached`.
        limit: largest cost-so-far that fits.
        heads: (m,) int32, all -1; m a power of two above the largest rise of f in a step.
        queue: (q, 2) int32 for cell and cost-so-far of the entries.
        links: (q,) int32.
        start: cell number.
        goal: cell number.
        most: expansions after which to give up with LIMIT.
        stop: (1,) uint8, set to anything but 0 by another thread to have it STOPPED.

    Returns:
        (status, cost of the path, cells expanded). `heads` is all -1 again.
    """
    rows, columns = costs.shape
    goal_row, goal_column = goal // columns, goal % columns
    start_row, start_column = start // columns, start % columns
    straight, oblique = traverse[0], diagonal[0]
    mask = heads.size - 1
    rise = abs(start_row - goal_row)
    level = _octile(rise, abs(start_column - goal_column), straight, oblique)
    reached[start] = base
    parents[start] = 8
    queue[0, 0], queue[0, 1], links[0] = start, 0, -1
    heads[level & mask] = 0
    waiting, fresh, spare, expanded, look = 1, 1, -1, 0, 0
    status, total = NO_WAY, -1
    while waiting > 0:
        entry = heads[level & mask]
        if entry < 0:
            level += 1
            continue
        heads[level & mask] = links[entry]
        cell, so_far = queue[entry, 0], queue[entry, 1]
        links[entry] = spare
        spare = entry
        waiting -= 1
        if reached[cell] != base + so_far:
            continue  # a cheaper way to it was found after this entry was queued
        if cell == goal:
            status, total = FOUND, so_far
            break
        if expanded == look:
            if expanded >= most or stop[0] != 0:
                status = STOPPED if stop[0] != 0 else LIMIT
                break
            look = min(expanded + CHECKED, most)
        expanded += 1
        row = cell // columns
        column = cell - row * columns
        inner = 0 < row < rows - 1 and 0 < column < columns - 1
        here = costs[row, column]
        stuck = traverse[here] == 0
        passable = 0
        for direction in range(8):
            next_row, next_column = row + ROW_STEP[direction], column + COLUMN_STEP[direction]
            if not (inner or (0 <= next_row < rows and 0 <= next_column < columns)):
                continue
            there = costs[next_row, next_column]
            step = traverse[there] if direction < 4 else diagonal[there]
            if step == 0:
                away = max(abs(next_row - start_row), abs(next_column - start_column))
                if escape[there] > escape[here] or away > escape_reach:
                    continue
                step = escape[there]
            elif direction < 4:
                passable |= 1 << direction
            sides = SIDES[direction]
            if (passable & sides) != sides and not stuck:
                continue
            cost = so_far + step
            neighbour = next_row * columns + next_column
            if cost > limit:
                status = RANGE_FULL
                break
            if base + cost >= reached[neighbour]:
                continue
            reached[neighbour] = base + cost
            parents[neighbour] = direction
            f = cost + _octile(
                abs(next_row - goal_row), abs(next_column - goal_column), straight, oblique
            )
            if spare >= 0:
                slot = spare
                spare = links[slot]
            elif fresh < links.size:
                slot = fresh
                fresh += 1
            else:
                status = QUEUE_FULL
                break
            queue[slot, 0], queue[slot, 1] = neighbour, cost
            links[slot] = heads[f & mask]
            heads[f & mask] = slot
            waiting += 1
        if status == RANGE_FULL or status == QUEUE_FULL:
            break
    heads[:] = -1
    return status, total, expanded


@njit(cache=True, nogil=True)
def extract(parents, columns, start, goal):
    """(n, 2) rows and columns of the cells from start to goal."""
    count, cell = 1, goal
    while cell != start:
        direction = parents[cell]
        cell -= ROW_STEP[direction] * columns + COLUMN_STEP[direction]
        count += 1
    cells = np.empty((count, 2), np.int64)
    cell = goal
    for index in range(count - 1, -1, -1):
        cells[index, 0], cells[index, 1] = cell // columns, cell % columns
        if index > 0:
            direction = parents[cell]
            cell -= ROW_STEP[direction] * columns + COLUMN_STEP[direction]
    return cells


@njit(cache=True, nogil=True)
def nearest_passable(costs, traverse, row, column, reach):
    """Nearest cell with a way to a place given in cells, within `reach`; (-1, -1) for none.

    The place is (row, column) in fractions of cells: the middle of cell (0, 0) is (0.5, 0.5).
    """
    rows, columns = costs.shape
    best, best_row, best_column = reach * reach + 1e-9, -1, -1
    for near_row in range(max(int(row - reach), 0), min(int(row + reach) + 2, rows)):
        for near_column in range(
            max(int(column - reach), 0), min(int(column + reach) + 2, columns)
        ):
            if traverse[costs[near_row, near_column]] > 0:
                rise, run = near_row + 0.5 - row, near_column + 0.5 - column
                square = rise * rise + run * run
                if square < best:
                    best, best_row, best_column = square, near_row, near_column
    return best_row, best_column


@njit(cache=True, nogil=True)
def nearest_reached(costs, traverse, reached, base, limit, row, column):
    """The cell with a way nearest to a place (as above) among those the last search reached."""
    rows, columns = costs.shape
    best, best_row, best_column = np.inf, -1, -1
    for near_row in range(rows):
        for near_column in range(columns):
            if reached[near_row * columns + near_column] > base + limit:
                continue
            if traverse[costs[near_row, near_column]] > 0:
                rise, run = near_row + 0.5 - row, near_column + 0.5 - column
                square = rise * rise + run * run
                if square < best:
                    best, best_row, best_column = square, near_row, near_column
    return best_row, best_column


@njit(cache=True, nogil=True)
def _line_cost(costs, traverse, x1, y1, x2, y2, budget):
    """Cost of a straight line, in cells times traverse; -1 without a way or above the budget."""
    rows, columns = costs.shape
    length = np.hypot(x2 - x1, y2 - y1)
    steps = max(int(np.ceil(2.0 * length)), 1)
    total = 0.0
    budget *= steps / max(length, 1e-9)
    for step in range(steps + 1):
        share = step / steps
        column = int(np.floor(x1 + share * (x2 - x1)))
        row = int(np.floor(y1 + share * (y2 - y1)))
        if not (0 <= row < rows and 0 <= column < columns):
            return -1.0
        value = traverse[costs[row, column]]
        total += value * (0.5 if step == 0 or step == steps else 1.0)
        if value == 0 or total > budget:
            return -1.0
    return total * length / steps


@njit(cache=True, nogil=True)
def straighten(costs, traverse, points, stride, window):
    """Replace stretches of a path of points (n, 2), in cells, by straight lines that cost less.

    The cheapest chain of lines between every `stride`-th point, each over at most `window` such
    stretches, by dynamic programming: it cuts across open floor and stays in the middle of a
    corridor. Returns the indices of the kept points.
    """
    count = points.shape[0]
    last = (count - 2) // stride + 1
    along = np.zeros(count)
    for index in range(1, count):
        x1, y1 = points[index - 1, 0], points[index - 1, 1]
        x2, y2 = points[index, 0], points[index, 1]
        cost = _line_cost(costs, traverse, x1, y1, x2, y2, np.inf)
        if cost < 0.0:  # leaving a bad start: any free line is better
            cost = 1e6 * np.hypot(x2 - x1, y2 - y1)
        along[index] = along[index - 1] + cost
    best = np.zeros(last + 1)
    before = np.full(last + 1, -1, np.int64)  # -1: along the path itself from the knot before
    for knot in range(1, last + 1):
        end = min(knot * stride, count - 1)
        x2, y2 = points[end, 0], points[end, 1]
        best[knot] = best[knot - 1] + along[end] - along[(knot - 1) * stride]
        for other in range(knot - 1, max(knot - window, 0) - 1, -1):
            x1, y1 = points[other * stride, 0], points[other * stride, 1]
            least = best[other] + traverse[0] * np.hypot(x2 - x1, y2 - y1)
            if least >= best[knot]:
                continue
            cost = _line_cost(costs, traverse, x1, y1, x2, y2, best[knot] - best[other])
            if cost >= 0.0 and best[other] + cost < best[knot]:
                best[knot], before[knot] = best[other] + cost, other
    keep = np.zeros(count, np.bool_)
    keep[0] = True
    knot = last
    while knot > 0:
        end = min(knot * stride, count - 1)
        keep[end] = True
        if before[knot] < 0:
            keep[(knot - 1) * stride : end] = True
            knot -= 1
        else:
            knot = before[knot]
    return np.nonzero(keep)[0]


@njit(cache=True, nogil=True)
def _is_way_between(costs, traverse, x1, y1, x2, y2):
    """Whether the cell half-way between two points of the grid can be passed."""
    return traverse[costs[int(np.floor(0.5 * (y1 + y2))), int(np.floor(0.5 * (x1 + x2)))]] > 0


@njit(cache=True, nogil=True)
def round_corners(costs, traverse, points, weight_data, weight_smooth, easy, iterations):
    """Pull points (n, 2), in cells, towards their neighbours' middle and back to where they were.

    The data and smoothness terms of Dolgov et al. (2010), by Gauss-Seidel; the ends stay. A point
    never moves into a cell that costs more than both its present one and `easy`, nor to where the
    cell half-way to a neighbour cannot be passed.
    """
    rows, columns = costs.shape
    moved = points.copy()
    for _ in range(iterations):
        for index in range(1, points.shape[0] - 1):
            x, y = moved[index, 0], moved[index, 1]
            pull_x = weight_data * (points[index, 0] - x)
            pull_x += weight_smooth * (moved[index - 1, 0] + moved[index + 1, 0] - 2.0 * x)
            pull_y = weight_data * (points[index, 1] - y)
            pull_y += weight_smooth * (moved[index - 1, 1] + moved[index + 1, 1] - 2.0 * y)
            if abs(pull_x) + abs(pull_y) < AT_REST:
                continue
            new_x, new_y = x + pull_x, y + pull_y
            column, row = int(np.floor(new_x)), int(np.floor(new_y))
            if not (0 <= row < rows and 0 <= column < columns):
                continue
            cost = traverse[costs[row, column]]
            here = traverse[costs[int(np.floor(y)), int(np.floor(x))]]
            if cost == 0 or (cost > easy and cost > here):
                continue
            if _is_way_between(
                costs, traverse, new_x, new_y, moved[index - 1, 0], moved[index - 1, 1]
            ) and _is_way_between(
                costs, traverse, new_x, new_y, moved[index + 1, 0], moved[index + 1, 1]
            ):
                moved[index, 0], moved[index, 1] = new_x, new_y
    return moved


@njit(cache=True, nogil=True)
def blocked_steps(costs, traverse, points):
    """How many of the steps between points (n, 2), in cells, meet a cell with no way."""
    blocked = 0
    for index in range(1, points.shape[0]):
        x1, y1 = points[index - 1, 0], points[index - 1, 1]
        x2, y2 = points[index, 0], points[index, 1]
        if _line_cost(costs, traverse, x1, y1, x2, y2, np.inf) < 0.0:
            blocked += 1
    return blocked
