# mypy: allow-untyped-defs
"""Compiled loops of the costmap: beams, layers, inflation and footprints.

Grids are (rows, columns), row 0 at the smallest y. A box is (first row, last row + 1, first column,
last column + 1); it is empty when the first value is not below the second. `marked_at` holds the
time at which a cell was last seen occupied, -inf where it never was.
"""

import numpy as np
from numba import b1, f4, f8, i8, u1

from stack.kernel_cache import njit

FREE, INSCRIBED, LETHAL, UNKNOWN = 0, 253, 254, 255
NEVER_SEEN = -np.inf


@njit(cache=True, nogil=True)
def _clear_line(marked_at, seen, row, column, end_row, end_column, clearable):
    """Clear the cells on a line (Bresenham 1965), without the end cell.

    Marks later than `clearable` stay.
    """
    rows, columns = marked_at.shape
    rise, run = abs(end_row - row), abs(end_column - column)
    row_step = 1 if end_row > row else -1
    column_step = 1 if end_column > column else -1
    longer, shorter = max(rise, run), min(rise, run)
    begins_inside = 0 <= row < rows and 0 <= column < columns
    error = longer - shorter
    for _ in range(longer):
        if 0 <= row < rows and 0 <= column < columns:
            if marked_at[row, column] <= clearable:
                marked_at[row, column] = NEVER_SEEN
            seen[row, column] = 1
        elif begins_inside:
            break  # it does not come back
        is_aside = 2 * error < longer
        error += longer * is_aside - shorter
        row += row_step * (is_aside or rise > run)
        column += column_step * (is_aside or run >= rise)


@njit(cache=True, nogil=True)
def _clear_distance(ranges, beam, range_max, clearing_range, closed):
    """Distance up to which a beam shows free space; see ObstacleLayer.

    A beam without return shows no more than each of its neighbours: a neighbour with a return shows
    free space up to the return, an invalid one none. In a closed scan the first and the last beam
    are neighbours; otherwise they have one neighbour each.
    """
    distance = np.float64(ranges[beam])
    if distance < range_max:
        return min(distance, clearing_range)
    for near in (beam - 1, beam + 1):
        if closed:
            near %= ranges.size
        elif near < 0 or near >= ranges.size:
            continue
        beside = np.float64(ranges[near])
        if not beside > 0.0:
            return 0.0
        if beside < range_max:
            clearing_range = min(beside, clearing_range)
    return clearing_range


@njit(cache=True, nogil=True)
def sense(
    marked_at, seen, origin_x, origin_y, resolution, sensor_x, sensor_y, sensor_heading,
    ranges, angles, closed, range_max, obstacle_range, clearing_range, time, clearable,
):  # fmt: skip
    """Clear the cells along all beams, then mark their end cells.

    All clearing comes first, so that no beam clears the mark of another one of the same scan.
    Returns the box of the cells that may have changed.
    """
    rows, columns = marked_at.shape
    row = int(np.floor((sensor_y - origin_y) / resolution))
    column = int(np.floor((sensor_x - origin_x) / resolution))
    marks = np.empty((ranges.size, 2), np.int64)
    count = 0
    top, bottom, left, right = row, row, column, column
    for beam in range(ranges.size):
        distance = np.float64(ranges[beam])
        if not distance > 0.0:
            continue
        reach = _clear_distance(ranges, beam, range_max, clearing_range, closed)
        angle = sensor_heading + angles[beam]
        end_row = int(np.floor((sensor_y + reach * np.sin(angle) - origin_y) / resolution))
        end_column = int(np.floor((sensor_x + reach * np.cos(angle) - origin_x) / resolution))
        top, bottom = min(top, end_row), max(bottom, end_row)
        left, right = min(left, end_column), max(right, end_column)
        _clear_line(marked_at, seen, row, column, end_row, end_column, clearable)
        if distance < range_max and distance <= obstacle_range:
            marks[count, 0], marks[count, 1] = end_row, end_column
            count += 1
    for mark in range(count):
        if 0 <= marks[mark, 0] < rows and 0 <= marks[mark, 1] < columns:
            marked_at[marks[mark, 0], marks[mark, 1]] = time
    return max(top, 0), min(bottom + 1, rows), max(left, 0), min(right + 1, columns)


@njit(cache=True, nogil=True)
def clear_passed(
    marked_at, origin_x, origin_y, resolution, sensor_x, sensor_y, sensor_heading,
    ranges, angles, closed, range_max, clearing_range, width, oldest, top, bottom, left, right,
):  # fmt: skip
    """Clear marks before `oldest` in a box, if the beams on both sides reach beyond their cells.

    The beams must be at most `width` metres apart there. Returns the box of the cleared cells.
    """
    beams = ranges.size
    cleared_top, cleared_bottom, cleared_left, cleared_right = bottom, top - 1, right, left - 1
    step = (angles[beams - 1] - angles[0]) / (beams - 1)
    for row in range(top, bottom):
        y = origin_y + (row + 0.5) * resolution - sensor_y
        for column in range(left, right):
            time = marked_at[row, column]
            if time == NEVER_SEEN or time >= oldest:
                continue
            x = origin_x + (column + 0.5) * resolution - sensor_x
            beyond = np.hypot(x, y) + resolution
            if beyond > clearing_range or beyond * abs(step) > width:
                continue
            turn = np.arctan2(y, x) - sensor_heading - angles[0]
            before = int((turn * np.sign(step)) % (2.0 * np.pi) / abs(step))
            after = before + 1
            if closed:
                before, after = min(before, beams - 1), after if after < beams else 0
            elif after >= beams:
                continue
            for beam in (before, after):
                if not ranges[beam] > 0.0:
                    break
                reach = _clear_distance(ranges, beam, range_max, clearing_range, closed)
                if reach <= beyond:
                    break
            else:
                marked_at[row, column] = NEVER_SEEN
                cleared_top, cleared_bottom = min(cleared_top, row), max(cleared_bottom, row)
                cleared_left, cleared_right = min(cleared_left, column), max(cleared_right, column)
    return cleared_top, cleared_bottom + 1, cleared_left, cleared_right + 1


@njit(cache=True, nogil=True)
def clear_polygon(marked_at, others, value, origin_x, origin_y, resolution, corners):
    """Clear the cells with their centre in a polygon (n, 2), metres. Returns the cells' box.

    In `others`, of the same shape, these cells get a value.
    """
    rows, columns = marked_at.shape
    top = max(int(np.floor((corners[:, 1].min() - origin_y) / resolution)), 0)
    bottom = min(int(np.floor((corners[:, 1].max() - origin_y) / resolution)) + 1, rows)
    left = max(int(np.floor((corners[:, 0].min() - origin_x) / resolution)), 0)
    right = min(int(np.floor((corners[:, 0].max() - origin_x) / resolution)) + 1, columns)
    crossings = np.empty(corners.shape[0])
    for row in range(top, bottom):
        y = origin_y + (row + 0.5) * resolution
        count, last = 0, corners.shape[0] - 1
        for corner in range(corners.shape[0]):
            x1, y1 = corners[corner, 0], corners[corner, 1]
            x2, y2 = corners[last, 0], corners[last, 1]
            if (y1 > y) != (y2 > y):
                crossings[count] = x1 + (y - y1) * (x2 - x1) / (y2 - y1)
                count += 1
            last = corner
        for column in range(left, right):
            x = origin_x + (column + 0.5) * resolution
            inside = False
            for crossing in range(count):
                if x < crossings[crossing]:
                    inside = not inside
            if inside:
                marked_at[row, column] = NEVER_SEEN
                others[row, column] = value
    return top, bottom, left, right


@njit(cache=True, nogil=True)
def expire(marked_at, oldest, top, bottom, left, right):
    """Clear marks older than `oldest` in a box.

    Returns the box of the cleared cells, the box of the marks that remain, and the time of the
    oldest of these, inf without any.
    """
    earliest = np.inf
    cleared_top, cleared_bottom, cleared_left, cleared_right = bottom, top - 1, right, left - 1
    kept_top, kept_bottom, kept_left, kept_right = bottom, top - 1, right, left - 1
    for row in range(top, bottom):
        for column in range(left, right):
            time = marked_at[row, column]
            if time == NEVER_SEEN:
                continue
            if time < oldest:
                marked_at[row, column] = NEVER_SEEN
                cleared_top, cleared_bottom = min(cleared_top, row), max(cleared_bottom, row)
                cleared_left, cleared_right = min(cleared_left, column), max(cleared_right, column)
            else:
                kept_top, kept_bottom = min(kept_top, row), max(kept_bottom, row)
                kept_left, kept_right = min(kept_left, column), max(kept_right, column)
                earliest = min(earliest, np.float64(time))
    cleared = cleared_top, cleared_bottom + 1, cleared_left, cleared_right + 1
    return cleared, (kept_top, kept_bottom + 1, kept_left, kept_right + 1), earliest


@njit(cache=True, nogil=True)
def paint_marks(cells, marked_at, seen, top, bottom, left, right):
    """Paint marks over the cells of a box: lethal; free where seen free and unknown so far."""
    for row in range(top, bottom):
        target = cells[row - top]
        times, is_seen = marked_at[row, left:right], seen[row, left:right]
        for column in range(right - left):  # every cell is written: this way it is vectorised
            value = target[column]
            value = FREE if is_seen[column] and value == UNKNOWN else value
            target[column] = LETHAL if times[column] > NEVER_SEEN else value


@njit(cache=True, nogil=True)
def _is_small(cells, ground, row, column, smallest, group):
    """Whether a cell's lethal group has fewer than `smallest` cells and none of the map's."""
    rows, columns = cells.shape
    group[0, 0], group[0, 1] = row, column
    count, done = 1, 0
    while done < count:
        middle_row, middle_column = group[done, 0], group[done, 1]
        done += 1
        for near_row in range(max(middle_row - 1, 0), min(middle_row + 2, rows)):
            for near_column in range(max(middle_column - 1, 0), min(middle_column + 2, columns)):
                if cells[near_row, near_column] != LETHAL:
                    continue
                known = False
                for index in range(count):
                    known |= group[index, 0] == near_row and group[index, 1] == near_column
                if known:
                    continue
                if count + 1 >= smallest or ground[near_row, near_column] == LETHAL:
                    return False
                group[count, 0], group[count, 1] = near_row, near_column
                count += 1
    return True


@njit(cache=True, nogil=True)
def drop_small_groups(cells, ground, smallest):
    """Reset 8-connected lethal groups of less than `smallest` cells to the ground, or free."""
    group = np.empty((smallest, 2), np.int64)
    small = np.zeros(cells.shape, np.uint8)
    for row in range(cells.shape[0]):
        for column in range(cells.shape[1]):
            if cells[row, column] == LETHAL and ground[row, column] != LETHAL:
                small[row, column] = _is_small(cells, ground, row, column, smallest, group)
    for row in range(cells.shape[0]):
        for column in range(cells.shape[1]):
            if small[row, column]:
                value = ground[row, column]
                cells[row, column] = FREE if value == UNKNOWN else value


@njit(cache=True, nogil=True)
def hear(
    probability, heard_at, origin_x, origin_y, resolution, sensor_x, sensor_y, sensor_heading,
    distance, end, half_angle, rim, fading, thickness, time, top, bottom, left, right,
):  # fmt: skip
    """Bayesian update of a box of cells from one reading of a range sensor's cone.

    The sensor model is that of Nav2's RangeSensorLayer: confidence falls with the square of the
    bearing, to the share `rim` at the rim of the cone (0 in Nav2), and, around the distance
    `fading`, with the distance. Cells nearer than the reading are probably free, cells within
    `thickness` of it probably occupied; farther cells do not change. An infinite distance frees the
    cone up to `end`.
    """
    ahead_x, ahead_y = np.cos(sensor_heading), np.sin(sensor_heading)
    narrow, least = half_angle < 0.5 * np.pi, np.cos(half_angle) - 1e-6
    farthest = end * end * (1.0 + 1e-6)
    for row in range(top, bottom):
        y = origin_y + (row + 0.5) * resolution - sensor_y
        for column in range(left, right):
            x = origin_x + (column + 0.5) * resolution - sensor_x
            # most cells of the box are not in the cone: leave them out without an arctangent
            squared, ahead = x * x + y * y, x * ahead_x + y * ahead_y
            if squared > farthest:
                continue
            if narrow and (ahead < 0.0 or ahead * ahead < least * abs(least) * squared):
                continue
            away = np.hypot(x, y)
            bearing = np.arctan2(y, x) - sensor_heading
            bearing = abs((bearing + np.pi) % (2.0 * np.pi) - np.pi)
            if bearing > half_angle or away > end:
                continue
            nearness = 1.0 - 0.5 * (1.0 + np.tanh(2.0 * (away - fading)))
            falloff = (bearing / half_angle) ** 2
            trust = nearness * (1.0 - (1.0 - rim) * falloff)
            if away < distance - 2.0 * thickness:
                occupied = 0.5 * (1.0 - trust)
            elif away < distance - thickness:
                share = (away - distance + 2.0 * thickness) / thickness
                occupied = 0.5 * (1.0 - trust) + 0.5 * trust * share * share
            elif away < distance + thickness:
                share = (distance - away) / thickness
                occupied = 0.5 + trust * (0.5 - 0.5 * share * share)
            else:
                continue
            before = probability[row, column]
            hit, miss = occupied * before, (1.0 - occupied) * (1.0 - before)
            probability[row, column] = min(0.98, max(0.02, hit / (hit + miss)))
            heard_at[row, column] = time


@njit(cache=True, nogil=True)
def _copy(target, source):
    """Copy a row of cells; numba vectorises a loop but not an assignment of arrays."""
    for column in range(target.size):
        target[column] = source[column]


@njit(cache=True, nogil=True)
def write_changed(base, canvas, canvas_top, canvas_left, top, bottom, left, right):
    """Copy a box from a canvas to the base; returns the box of the cells that changed."""
    first_row, last_row, first_column, last_column = bottom, top - 1, right, left - 1
    shift, width = left - canvas_left, right - left
    for row in range(top, bottom):
        source, target = canvas[row - canvas_top, shift : shift + width], base[row, left:right]
        differences = np.uint8(0)
        for column in range(width):  # in 8 bits: this way it is vectorised
            differences = np.uint8(differences | (source[column] ^ target[column]))
        if differences == 0:
            continue
        first, last = 0, width - 1
        while source[first] == target[first]:
            first += 1
        while source[last] == target[last]:
            last -= 1
        _copy(target, source)
        first_row, last_row = min(first_row, row), row
        first_column, last_column = min(first_column, left + first), max(last_column, left + last)
    return first_row, last_row + 1, first_column, last_column + 1


@njit(cache=True, nogil=True)
def _rows_to_lethal(base, limit, top, bottom, left, right):
    """Distance in rows to the nearest lethal cell of the same column, capped at limit + 1."""
    distances = np.empty((bottom - top, right - left), np.int32)
    gaps = np.full(right - left, limit + 1, np.int32)
    for row in range(max(top - limit, 0), bottom):
        _count_rows(gaps, base[row, left:right], limit)
        if row >= top:
            _copy(distances[row - top], gaps)
    gaps[:] = limit + 1
    for row in range(min(bottom + limit, base.shape[0]) - 1, top - 1, -1):
        _count_rows(gaps, base[row, left:right], limit)
        if row < bottom:
            nearest = distances[row - top]
            for column in range(right - left):
                nearest[column] = min(nearest[column], gaps[column])
    return distances


@njit(cache=True, nogil=True)
def _count_rows(gaps, cells, limit):
    """Add a row to the distances since the last lethal cell of each column, up to limit + 1."""
    for column in range(gaps.size):  # in 32 bits: this way it is vectorised
        further = min(gaps[column] + np.int32(1), np.int32(limit + 1))
        gaps[column] = np.int32(0) if cells[column] == LETHAL else np.int32(further)


@njit(cache=True, nogil=True)
def inflate(cells, base, costs, limit, top, bottom, left, right):
    """Inflate a box: costs from the exact Euclidean distance to the nearest lethal cell.

    The distance transform is separable (Felzenszwalb and Huttenlocher 2012) and bounded by `limit`
    cells: the squared distance of a cell is the least sum of squares of the columns to a lethal
    cell and the rows to it. All columns within the limit are compared, for all cells of a row at
    once; up to a limit of 100 cells this is faster than the lower envelope of parabolas. Squared
    distances are whole numbers and index `costs`, shape (limit² + 1,).
    """
    outer_left, outer_right = max(left - limit, 0), min(right + limit, base.shape[1])
    heights = _rows_to_lethal(base, limit, top, bottom, outer_left, outer_right)
    width, far = right - left, np.int32(limit * limit + 1)
    prices = np.zeros(costs.size + 1, np.uint8)  # nothing at the distance `far`
    prices[: costs.size] = costs
    nearest = np.empty(width, np.int32)
    squares = np.full(width + 2 * limit, far, np.int32)  # of the heights; `far` off the grid
    first = outer_left - left + limit
    known, below = squares[first : first + outer_right - outer_left], squares[limit:][:width]
    for row in range(top, bottom):
        source, target, high = base[row, left:right], cells[row, left:right], heights[row - top]
        least = np.int32(limit + 1)
        for column in range(known.size):
            known[column] = min(high[column] * high[column], far)
            least = min(least, high[column])
        if least > limit:
            _copy(target, source)
            continue
        _copy(nearest, below)
        for away in range(1, int(np.sqrt(limit * limit - least * least)) + 1):
            before, after = squares[limit - away :][:width], squares[limit + away :][:width]
            for column in range(width):  # in 32 bits: this way it is vectorised
                beside = np.int32(min(before[column], after[column]) + np.int32(away * away))
                nearest[column] = min(nearest[column], beside)
        for column in range(width):
            value, cost = source[column], prices[nearest[column]]
            is_raised = cost > value or (value == UNKNOWN and cost >= INSCRIBED)
            target[column] = cost if is_raised else value


@njit(cache=True, nogil=True)
def first_collision(cells, origin_x, origin_y, resolution, points, x, y, near, least):
    """Number of the first point (n, 2) on a cost from `least` to LETHAL; -1 without one.

    Points within `near` metres of (x, y), and those off the grid, do not count.
    """
    rows, columns = cells.shape
    for number in range(points.shape[0]):
        row = int(np.floor((points[number, 1] - origin_y) / resolution))
        column = int(np.floor((points[number, 0] - origin_x) / resolution))
        if not (0 <= row < rows and 0 <= column < columns):
            continue
        if least <= cells[row, column] <= LETHAL:
            if np.hypot(points[number, 0] - x, points[number, 1] - y) > near:
                return number
    return -1


INFLATION = (
    (inflate, (u1[:, ::1], u1[:, ::1], u1[::1], *5 * (i8,))),
    (write_changed, (u1[:, ::1], u1[:, ::1], *6 * (i8,))),
    (first_collision, (u1[:, ::1], f8, f8, f8, f8[:, ::1], f8, f8, f8, i8)),
)
"""Entry points of every costmap, with the types that it calls them with; then of layers."""
OBSTACLES = (
    (sense, (f4[:, ::1], u1[:, ::1], *6 * (f8,), f4[::1], f8[::1], b1, *5 * (f8,))),
    (clear_passed, (f4[:, ::1], *6 * (f8,), f4[::1], f8[::1], b1, *4 * (f8,), *4 * (i8,))),
    (clear_polygon, (f4[:, ::1], u1[:, ::1], i8, f8, f8, f8, f8[:, ::1])),
    (expire, (f4[:, ::1], f8, i8, i8, i8, i8)),
    (paint_marks, (u1[:, ::1], f4[:, ::1], u1[:, ::1], i8, i8, i8, i8)),
)
RANGES = (
    (hear, (f4[:, ::1], f4[:, ::1], *13 * (f8,), i8, i8, i8, i8)),
    (clear_polygon, (f4[:, ::1], f4[:, ::1], *4 * (f8,), f8[:, ::1])),
    (expire, (f4[:, ::1], f8, i8, i8, i8, i8)),
)
DENOISING = (
    (drop_small_groups, (u1[:, ::1], u1[:, ::1], i8)),
    (drop_small_groups, (u1[:, ::1], u1[:, :], i8)),
)
