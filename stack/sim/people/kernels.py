"""Numba kernels of people who keep a distance to each other, to walls and to robots."""

from __future__ import annotations

from math import cos, exp, hypot, inf, sqrt

import numpy as np
from numba import boolean, float32, float64, int64
from numpy.typing import NDArray

from stack.kernel_cache import njit
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def sweep_times(times: FloatArray, pace: FloatArray, resolution: float) -> int:
    """Complete the walking times from a goal to all cells, by fast sweeping (Zhao 2005).

    Args:
        times: (rows, columns) seconds; 0 in the goal's cell, inf elsewhere. Changed in place.
        pace: (rows, columns) seconds per metre; inf where nobody can walk.
        resolution: side of a cell, metres.

    Returns:
        The number of rounds of four sweeps until nothing changed, at most 100.
    """
    rows, columns = times.shape
    for count in range(100):
        changed = False
        for sweep in range(4):
            for i in range(rows):
                row = i if sweep < 2 else rows - 1 - i
                for j in range(columns):
                    column = j if sweep % 2 == 0 else columns - 1 - j
                    cost = pace[row, column] * resolution
                    if cost == inf:
                        continue
                    a = min(
                        times[row - 1, column] if row > 0 else inf,
                        times[row + 1, column] if row + 1 < rows else inf,
                    )
                    b = min(
                        times[row, column - 1] if column > 0 else inf,
                        times[row, column + 1] if column + 1 < columns else inf,
                    )
                    if min(a, b) == inf:
                        continue
                    if abs(a - b) >= cost:
                        time = min(a, b) + cost
                    else:
                        time = 0.5 * (a + b + sqrt(2.0 * cost * cost - (a - b) ** 2))
                    if time < times[row, column] - 1e-9:
                        times[row, column] = time
                        changed = True
        if not changed:
            return count + 1
    return 100


@njit(cache=True, nogil=True)
def _descent(field: NDArray[np.float32], row: int, column: int) -> tuple[float, float]:
    """Direction of the steepest descent of walking times in a cell, by upwind differences.

    In a cell where nobody can walk it is the direction to the best of its neighbours.
    """
    rows, columns = field.shape
    here = field[row, column]
    if here == inf:
        best, x, y = here, 0.0, 0.0
        for i in range(max(row - 2, 0), min(row + 3, rows)):
            for j in range(max(column - 2, 0), min(column + 3, columns)):
                if field[i, j] < best:
                    best, x, y = field[i, j], float(j - column), float(i - row)
    else:
        left = field[row, column - 1] if column > 0 else inf
        right = field[row, column + 1] if column + 1 < columns else inf
        below = field[row - 1, column] if row > 0 else inf
        above = field[row + 1, column] if row + 1 < rows else inf
        x, y = max(here - min(left, right), 0.0), max(here - min(below, above), 0.0)
        x, y = -x if left < right else x, -y if below < above else y
    length = hypot(x, y)
    return (x / length, y / length) if length > 1e-9 else (0.0, 0.0)


@njit(cache=True, nogil=True)
def directions(
    times: NDArray[np.float32], numbers: NDArray[np.int64], resolution: float, origin_x: float,
    origin_y: float, goals: FloatArray, places: FloatArray, reach: int,
) -> FloatArray:  # fmt: skip
    """Direction in which each of n people walks to its goal.

    Args:
        times: (k, rows, columns) seconds to each of k goals; inf where nobody can walk.
        numbers: (n,) the goal of each person.
        resolution: side of a cell, metres.
        origin_x: outer corner of cell (0, 0), metres.
        origin_y: of the same corner, metres.
        goals: (k, 2) metres.
        places: (n, 2) metres.
        reach: cells along the way to the point at which a person looks.

    Returns:
        (n, 2) unit vectors; zero at the goal.
    """
    found = np.zeros((places.shape[0], 2))
    _, rows, columns = times.shape
    for p in range(places.shape[0]):
        field = times[numbers[p]]
        x, y = goals[numbers[p], 0], goals[numbers[p], 1]
        if hypot(x - places[p, 0], y - places[p, 1]) > reach * resolution:
            x, y = places[p, 0], places[p, 1]
            for _ in range(reach):
                dx, dy = _descent(
                    field,
                    min(max(int((y - origin_y) / resolution), 0), rows - 1),
                    min(max(int((x - origin_x) / resolution), 0), columns - 1),
                )
                x, y = x + resolution * dx, y + resolution * dy
        dx, dy = x - places[p, 0], y - places[p, 1]
        length = hypot(dx, dy)
        if length > 1e-6:
            found[p, 0], found[p, 1] = dx / length, dy / length
    return found


@njit(cache=True, nogil=True)
def _repulsion(
    dx: float, dy: float, stride_x: float, stride_y: float, strength: float, scale: float
) -> tuple[float, float]:
    """Acceleration away from another, who takes a step; the potential is elliptical.

    Vectors are from the other to the person, and the step, velocity times stride time, in metres;
    the strength of the potential is in m²/s², its range in metres.
    """
    r = max(hypot(dx, dy), 1e-6)
    ex, ey = dx - stride_x, dy - stride_y
    e = max(hypot(ex, ey), 1e-6)
    b = 0.5 * sqrt(max((r + e) ** 2 - stride_x**2 - stride_y**2, 1e-6))
    size = strength / scale * exp(-b / scale) * (r + e) / (4.0 * b)
    return size * (dx / r + ex / e), size * (dy / r + ey / e)


@njit(cache=True, nogil=True)
def _distance_at(
    field: NDArray[np.float32], resolution: float, origin_x: float, origin_y: float,
    x: float, y: float,
) -> tuple[float, float, float]:  # fmt: skip
    """Bilinear distance to the nearest obstacle, metres, and its gradient."""
    rows, columns = field.shape
    u = min(max((x - origin_x) / resolution - 0.5, 0.0), columns - 1.001)
    v = min(max((y - origin_y) / resolution - 0.5, 0.0), rows - 1.001)
    column, row = int(u), int(v)
    a, b = u - column, v - row
    d00, d01 = field[row, column], field[row, column + 1]
    d10, d11 = field[row + 1, column], field[row + 1, column + 1]
    value = (1 - b) * ((1 - a) * d00 + a * d01) + b * ((1 - a) * d10 + a * d11)
    gx = ((1 - b) * (d01 - d00) + b * (d11 - d10)) / resolution
    gy = ((1 - a) * (d10 - d00) + a * (d11 - d01)) / resolution
    return value, gx, gy


@njit(cache=True, nogil=True)
def accelerations(
    places: FloatArray, velocities: FloatArray, wanted: FloatArray, radii: FloatArray,
    groups: NDArray[np.int64], robots: FloatArray, notices: NDArray[np.bool_],
    field: NDArray[np.float32], resolution: float, origin_x: float, origin_y: float,
    model: FloatArray, wall_weights: FloatArray,
) -> FloatArray:  # fmt: skip
    """Accelerations of n people by the social force model (Helbing and Molnár 1995).

    Args:
        places: (n, 2) metres.
        velocities: (n, 2) m/s.
        wanted: (n, 2) velocity that each would have if alone, m/s.
        radii: (n,) metres.
        groups: (n,) number of each person's group; -1: alone.
        robots: (r, 5) x, y, radius, and velocity of each, metres and m/s.
        notices: (n,) whether a person watches the robots.
        field: (rows, columns) distance to the nearest wall or obstacle, metres.
        resolution: side of its cells, metres.
        origin_x: outer corner of cell (0, 0), metres.
        origin_y: of the same corner, metres.
        model: relaxation time, stride time, strength and range among people, strength and range at
            walls, weight of what is out of sight, cosine of half the field of view, pull of a
            group, metres from its centre at which it begins, and share of the repulsion against
            the wanted direction that also acts to the side.
        wall_weights: (n,) factor on the repulsion of walls for each person.

    Returns:
        (n, 2) m/s².
    """
    relaxation, stride, strength, scale = model[0], model[1], model[2], model[3]
    wall_strength, wall_scale, unseen, view = model[4], model[5], model[6], model[7]
    pull, together, sidestep = model[8], model[9], model[10]
    n, r = places.shape[0], robots.shape[0]
    found: FloatArray = (wanted - velocities) / relaxation
    for i in range(n):
        x, y = places[i, 0], places[i, 1]
        speed = hypot(wanted[i, 0], wanted[i, 1])
        fx, fy = 0.0, 0.0
        centre_x, centre_y, members = 0.0, 0.0, 0
        for j in range(n + r):
            if j == i or (j >= n and not notices[i]):
                continue
            in_group = j < n and groups[i] >= 0 and groups[j] == groups[i]
            if j < n:
                other_x, other_y, radius = places[j, 0], places[j, 1], radii[j]
                other_vx, other_vy = velocities[j, 0], velocities[j, 1]
                if in_group:
                    centre_x, centre_y, members = (
                        centre_x + other_x,
                        centre_y + other_y,
                        members + 1,
                    )
            else:
                other_x, other_y, radius = robots[j - n, 0], robots[j - n, 1], robots[j - n, 2]
                other_vx, other_vy = robots[j - n, 3], robots[j - n, 4]
            dx, dy = x - other_x, y - other_y
            distance = max(hypot(dx, dy), 1e-6)
            # The potential is one of points with 0.2 m of body: larger bodies are farther away.
            shrink = max(distance - (radii[i] + radius - 0.4), 0.05) / distance
            if shrink * distance > 5.0:
                continue
            px, py = _repulsion(
                shrink * dx, shrink * dy, other_vx * stride, other_vy * stride, strength, scale
            )
            seen = speed < 1e-6 or wanted[i, 0] * -px + wanted[i, 1] * -py >= (
                view * speed * hypot(px, py)
            )
            weight = 1.0 if seen else unseen
            fx, fy = fx + weight * px, fy + weight * py
            if seen and speed > 1e-6 and not in_group:
                ex, ey = wanted[i, 0] / speed, wanted[i, 1] / speed
                aside = max(-(px * ex + py * ey), 0.0) * sidestep
                # To the side on which the person already is; to the right if straight ahead.
                left = ex * dy - ey * dx > 0.02 * distance
                fx += -ey * aside if left else ey * aside
                fy += ex * aside if left else -ex * aside
        distance, gx, gy = _distance_at(field, resolution, origin_x, origin_y, x, y)
        push = wall_strength / wall_scale * exp(-max(distance, 0.0) / wall_scale)
        push *= wall_weights[i]
        found[i, 0] += fx + push * gx
        found[i, 1] += fy + push * gy
        if members > 0:
            dx, dy = centre_x / members - x, centre_y / members - y
            away = hypot(dx, dy)
            if away > together:
                found[i, 0] += pull * dx / away
                found[i, 1] += pull * dy / away
    return found


@njit(cache=True, nogil=True)
def separate(
    places: FloatArray, radii: FloatArray, robots: FloatArray, notices: NDArray[np.bool_],
    doors: FloatArray, field: NDArray[np.float32], resolution: float, origin_x: float,
    origin_y: float,
) -> None:  # fmt: skip
    """Move n people apart, out of walls and closed doors, and out of robots they watch; in place.

    Args:
        places: (n, 2) metres.
        radii: (n,) metres.
        robots: (r, 5) x, y, radius and velocity, metres and m/s.
        notices: (n,) whether a person watches the robots.
        doors: (d, 5) the ends of each closed door, and half its thickness, metres.
        field: (rows, columns) distance to the nearest wall or obstacle, metres.
        resolution: side of its cells, metres.
        origin_x: outer corner of cell (0, 0), metres.
        origin_y: of the same corner, metres.
    """
    n = places.shape[0]
    for i in range(n):
        for j in range(i + 1, n):
            dx, dy = places[i, 0] - places[j, 0], places[i, 1] - places[j, 1]
            distance = hypot(dx, dy)
            lacking = 0.5 * (radii[i] + radii[j] - distance)
            if lacking > 0.0:
                dx, dy = (dx / distance, dy / distance) if distance > 1e-6 else (1.0, 0.0)
                places[i, 0] += lacking * dx
                places[i, 1] += lacking * dy
                places[j, 0] -= lacking * dx
                places[j, 1] -= lacking * dy
    for i in range(n):
        for j in range(robots.shape[0]):
            dx, dy = places[i, 0] - robots[j, 0], places[i, 1] - robots[j, 1]
            distance = hypot(dx, dy)
            lacking = radii[i] + robots[j, 2] - distance
            if notices[i] and lacking > 0.0 and distance > 1e-6:
                step = min(lacking, 0.01)  # steps aside, and does not jump
                places[i, 0] += step * dx / distance
                places[i, 1] += step * dy / distance
        for k in range(doors.shape[0]):
            ax, ay = doors[k, 0], doors[k, 1]
            bx, by = doors[k, 2] - ax, doors[k, 3] - ay
            along = (places[i, 0] - ax) * bx + (places[i, 1] - ay) * by
            share = min(max(along / max(bx * bx + by * by, 1e-9), 0.0), 1.0)
            dx, dy = places[i, 0] - ax - share * bx, places[i, 1] - ay - share * by
            distance = hypot(dx, dy)
            lacking = radii[i] + doors[k, 4] - distance
            if lacking > 0.0 and distance > 1e-6:
                places[i, 0] += lacking * dx / distance
                places[i, 1] += lacking * dy / distance
        for _ in range(3):
            distance, gx, gy = _distance_at(
                field, resolution, origin_x, origin_y, places[i, 0], places[i, 1]
            )
            slope = hypot(gx, gy)
            lacking = radii[i] - distance
            if lacking <= 0.0 or slope < 1e-6:
                break
            places[i, 0] += lacking * gx / slope
            places[i, 1] += lacking * gy / slope


VIEW = cos(100.0 * np.pi / 180.0)
"""Cosine of half the field of view of 200 degrees (Helbing and Molnár 1995)."""

_PLANE, _FIELD, _ROW = float64[:, ::1], float32[:, ::1], float64[::1]
KERNELS = (
    (sweep_times, (_PLANE, _PLANE, float64)),
    (
        directions,
        (
            float32[:, :, ::1], int64[::1], float64, float64, float64, _PLANE, _PLANE, int64,
        ),
    ),
    (
        accelerations,
        (
            _PLANE, _PLANE, _PLANE, _ROW, int64[::1], _PLANE, boolean[::1], _FIELD, float64,
            float64, float64, _ROW, _ROW,
        ),
    ),
    (
        separate,
        (_PLANE, _ROW, _PLANE, boolean[::1], _PLANE, _FIELD, float64, float64, float64),
    ),
)  # fmt: skip
"""Entry points, with the types that `SocialForcePeople` calls them with."""
