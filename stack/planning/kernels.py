# mypy: allow-untyped-defs
"""Compiled loops of A* and of path smoothing.

Step costs are integers, so paths are exactly optimal and the same on every machine. `traverse`
(256,) int64 holds the cost of a straight step into a cell, by cell cost, 0 if the cell is
impassable; `diagonal` holds the cost of a diagonal step. The index of a cell is
row * columns + column.

The arrays are not cleared between queries: `reached` holds base + cost so far, and each query's
base is so far below the previous one that all older entries count as not reached.

`push` and `pop` serve the other searches. Numba's caches of their kernels do not notice a change
here: delete them after one.
"""

import numpy as np
from numba import b1, f8, i4, i8, u1

from stack.kernel_cache import njit

# Row and column steps to the neighbours: right, up, left, down, then the diagonals between them.
# SIDES is the bit mask of the two straight neighbours of a diagonal.
ROW_STEP = np.array([0, 1, 0, -1, 1, 1, -1, -1])
COLUMN_STEP = np.array([1, 0, -1, 0, 1, -1, -1, 1])
SIDES = np.array([0, 0, 0, 0, 0b0011, 0b0110, 0b1100, 0b1001])

AT_REST = 1e-3  # cells; smaller displacements are skipped to save the collision check
FOUND, NO_PATH, QUEUE_FULL, RANGE_FULL, LIMIT, STOPPED = 0, 1, 2, 3, 4, 5
CHECKED = 1024  # expansions between two checks of the cancel flag: at most 0.1 ms


@njit(cache=True, nogil=True)
def _octile(rows, columns, straight, oblique):
    """Octile distance in step costs: the cheapest path over free cells."""
    if rows > columns:
        return straight * (rows - columns) + oblique * columns
    return straight * (columns - rows) + oblique * rows


@njit(cache=True, nogil=True)
def search(
    costs, traverse, diagonal, escape, escape_reach,
    reached, parents, base, limit, heads, queue, links, start, goal, max_expansions, cancelled,
):  # fmt: skip
    """A* (Hart, Nilsson and Raphael 1968) with Dial's bucket queue (1969) on f = cost + heuristic.

    The octile heuristic is consistent for these costs, hence f never decreases and each cell is
    expanded once. A bucket is a linked stack: entries of equal f are popped last in, first out.

    Args:
        costs: (rows, columns) uint8.
        traverse: (256,) by cell cost, 0 if impassable; traverse[0] is the smallest positive one.
        diagonal: (256,) likewise.
        escape: (256,) cost of a step into an impassable cell while leaving an occupied start. It
            is higher for worse cells: such a cell is entered only from a cell at least as bad, so
            the search never returns to a worse cell.
        escape_reach: cells from the start within which that is allowed; 0 if the start is free.
        reached: (n,) int32 or int64, n >= cells; see the module docstring.
        parents: (n,) uint8, direction of the step into a cell; valid where reached.
        base: value of `reached` that means cost 0 in this query.
        limit: largest cost so far that `reached` can hold.
        heads: (m,) int32, all -1; m is a power of two above the largest increase of f in a step.
        queue: (q, 2) int64, cell and cost so far of each entry.
        links: (q,) int32, next entry of the same bucket.
        start: cell index.
        goal: cell index.
        max_expansions: number of expansions after which the search ends with LIMIT.
        cancelled: (1,) uint8; a value other than 0, set by another thread, ends it with STOPPED.

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
    waiting, fresh, spare, expanded, next_check = 1, 1, -1, 0, 0
    status, total = NO_PATH, -1
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
            continue  # a cheaper path to it was found after this entry was queued
        if cell == goal:
            status, total = FOUND, so_far
            break
        if expanded == next_check:
            if expanded >= max_expansions or cancelled[0] != 0:
                status = STOPPED if cancelled[0] != 0 else LIMIT
                break
            next_check = min(expanded + CHECKED, max_expansions)
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
def push(heap, count, f, number):
    """Add an entry to a binary heap, rows (f, number) ordered by f, then by number."""
    at = count
    while at > 0:
        above = (at - 1) // 2
        if heap[above, 0] < f or (heap[above, 0] == f and heap[above, 1] <= number):
            break
        heap[at] = heap[above]
        at = above
    heap[at, 0], heap[at, 1] = f, number


@njit(cache=True, nogil=True)
def pop(heap, count):
    """Remove and return the first of `count` heap entries: (f, number)."""
    f, number = heap[0, 0], heap[0, 1]
    last_f, last_number = heap[count - 1, 0], heap[count - 1, 1]
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
        if last_f < heap[below, 0] or (last_f == heap[below, 0] and last_number <= heap[below, 1]):
            break
        heap[at] = heap[below]
        at = below
    heap[at, 0], heap[at, 1] = last_f, last_number
    return f, np.int64(number)


@njit(cache=True, nogil=True)
def extract(parents, columns, start, goal):
    """Return (n, 2) rows and columns of the cells from start to goal."""
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
    """Return the passable cell nearest to (row, column), within `reach` cells, or (-1, -1).

    Row and column are fractional: the centre of cell (0, 0) is (0.5, 0.5).
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
def nearest_marked(marked, columns, row, column):
    """Return the index of the marked cell nearest to fractional (row, column), or -1."""
    best, found = np.inf, -1
    for cell in range(marked.size):
        if marked[cell]:
            rise, run = cell // columns + 0.5 - row, cell % columns + 0.5 - column
            square = rise * rise + run * run
            if square < best:
                best, found = square, cell
    return found


@njit(cache=True, nogil=True)
def _line_cost(costs, traverse, x1, y1, x2, y2, budget):
    """Cost of a straight line, in cells times traverse; -1 if impassable or above the budget."""
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
    """Replace parts of a path of points (n, 2), in cells, by straight lines that cost less.

    Dynamic programming finds the cheapest chain of lines between every `stride`-th point; a line
    spans at most `window` strides. The result cuts across open space and keeps to the middle of
    corridors. Returns the indices of the kept points.
    """
    count = points.shape[0]
    last = (count - 2) // stride + 1
    along = np.zeros(count)
    for index in range(1, count):
        x1, y1 = points[index - 1, 0], points[index - 1, 1]
        x2, y2 = points[index, 0], points[index, 1]
        cost = _line_cost(costs, traverse, x1, y1, x2, y2, np.inf)
        if cost < 0.0:  # leaving an occupied start: any free line is better
            cost = 1e6 * np.hypot(x2 - x1, y2 - y1)
        along[index] = along[index - 1] + cost
    best = np.zeros(last + 1)
    before = np.full(last + 1, -1, np.int64)  # -1: along the path itself from the previous knot
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
def _midpoint_passable(costs, traverse, x1, y1, x2, y2):
    """Return whether the cell at the midpoint of two points is passable."""
    return traverse[costs[int(np.floor(0.5 * (y1 + y2))), int(np.floor(0.5 * (x1 + x2)))]] > 0


@njit(cache=True, nogil=True)
def round_corners(costs, traverse, points, weight_data, weight_smooth, easy, iterations):
    """Smooth points (n, 2), in cells: pull them to their neighbours' midpoint and to their origin.

    The smoothness and data terms of Dolgov et al. (2010), solved by Gauss-Seidel; the ends are
    fixed. A point never moves into a cell that costs more than both its current cell and `easy`,
    nor where the cell at the midpoint to a neighbour is impassable.
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
            if _midpoint_passable(
                costs, traverse, new_x, new_y, moved[index - 1, 0], moved[index - 1, 1]
            ) and _midpoint_passable(
                costs, traverse, new_x, new_y, moved[index + 1, 0], moved[index + 1, 1]
            ):
                moved[index, 0], moved[index, 1] = new_x, new_y
    return moved


@njit(cache=True, nogil=True)
def blocked_steps(costs, traverse, points):
    """Count the steps between points (n, 2), in cells, that cross an impassable cell."""
    blocked = 0
    for index in range(1, points.shape[0]):
        x1, y1 = points[index - 1, 0], points[index - 1, 1]
        x2, y2 = points[index, 0], points[index, 1]
        if _line_cost(costs, traverse, x1, y1, x2, y2, np.inf) < 0.0:
            blocked += 1
    return blocked


SEARCH = (
    (
        search,
        (
            u1[:, ::1], i8[::1], i8[::1], i8[::1], i8, i4[::1], u1[::1], i8, i8, i4[::1],
            i8[:, ::1], i4[::1], i8, i8, i8, u1[::1],
        ),
    ),
)  # fmt: skip
"""Entry points, with the types that A* calls them with; then of other users."""
EXTRACTION = ((extract, (u1[::1], i8, i8, i8)),)
ENDPOINTS = (
    (nearest_passable, (u1[:, ::1], i8[::1], f8, f8, f8)),
    (nearest_marked, (b1[::1], i8, f8, f8)),
)
ROUNDING = ((round_corners, (u1[:, ::1], i8[::1], f8[:, ::1], f8, f8, i8, i8)),)
STRAIGHTENING = ((straighten, (u1[:, ::1], i8[::1], f8[:, ::1], i8, i8)),)
BLOCKED = ((blocked_steps, (u1[:, ::1], i8[::1], f8[:, ::1])),)
