"""Compiled loops of the localisation: scores, beam classes and their costs, ray casts.

Grids are (rows, columns) with row 0 at the smallest y; `origin` is the outer corner of cell (0, 0)
in metres. Poses are rows of x, y, heading. Points are (m, 2) in the base frame, metres.
"""

from __future__ import annotations

from math import cos, exp, floor, inf, isnan, nan, sin, sqrt

import numpy as np
from numba import f4, f8, i1, i2, i8, types, u1
from numpy.typing import NDArray

from stack.kernel_cache import njit
from stack.types import FloatArray

Floats = NDArray[np.float32]
Cells = NDArray[np.uint8]
Placement = tuple[float, float, float]
"""Resolution, origin x and origin y of a grid, metres."""

PLACEMENT = types.UniTuple(f8, 3)  # type: ignore[no-untyped-call]

NOTHING, WALL, UNSEEN = 0, 1, 2
"""Result of a ray cast within its limit: no hit, an occupied cell, an unknown cell."""

BLOCK = 256
"""Poses that `score_poses` processes together."""

IGNORED, MATCHED, SHORT, LONG, MISSING, SILENT, BEYOND = 0, 1, 2, 3, 4, 5, 6
"""Classes of a beam compared with the map; see `classify_beams`."""


@njit(cache=True, nogil=True)
def score_poses(
    table: NDArray[np.int16], occupancy: Cells, placement: Placement, poses: FloatArray,
    points: Floats,
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:  # fmt: skip
    """Sum of the table's values at the points, for each pose, and the poses in walls: (n,) each.

    Integers make the sum independent of its order, and so of the processor's vector width. The
    cells of one point are computed for a block of poses, then looked up in a loop of their own: the
    first loop is vectorised, whatever the number of points, and the block stays in the cache.

    Args:
        table: (rows + 2, columns + 2): the grid with a margin of one cell, which holds the value of
            all points outside the grid.
        occupancy: (rows, columns): 1 occupied. A pose outside the grid is in a wall, too.
        placement: of the grid without its margin.
        poses: (n, 3) map frame.
        points: (2, m) base frame.
    """
    resolution, origin_x, origin_y = placement
    # An unsigned index is looked up without the test for a negative one.
    columns = np.uint32(table.shape[1])
    flat = table.ravel()
    low, one = np.float32(0.0), np.float32(1.0)
    right, top = np.float32(table.shape[1] - 1), np.float32(table.shape[0] - 1)
    c, s = np.empty(BLOCK, dtype=np.float32), np.empty(BLOCK, dtype=np.float32)
    x, y = np.empty(BLOCK, dtype=np.float32), np.empty(BLOCK, dtype=np.float32)
    cells = np.empty(BLOCK, dtype=np.uint32)
    totals = np.empty(BLOCK, dtype=np.int32)
    scores = np.empty(poses.shape[0], dtype=np.int64)
    blocked = np.empty(poses.shape[0], dtype=np.bool_)
    for begin in range(0, poses.shape[0], BLOCK):
        size = min(BLOCK, poses.shape[0] - begin)
        for i in range(size):
            pose = poses[begin + i]
            c[i] = np.float32(cos(pose[2]) / resolution)
            s[i] = np.float32(sin(pose[2]) / resolution)
            u, v = (pose[0] - origin_x) / resolution, (pose[1] - origin_y) / resolution
            x[i], y[i], totals[i] = np.float32(u) + one, np.float32(v) + one, 0
            row, column = floor(v), floor(u)
            outside = min(row, column) < 0 or row >= occupancy.shape[0]
            outside = outside or column >= occupancy.shape[1]
            blocked[begin + i] = outside or occupancy[row, column] == 1
        for j in range(points.shape[1]):
            along, left = points[0, j], points[1, j]
            for i in range(size):
                u32 = min(max(x[i] + c[i] * along - s[i] * left, low), right)
                v32 = min(max(y[i] + s[i] * along + c[i] * left, low), top)
                cells[i] = np.uint32(np.int32(v32)) * columns + np.uint32(np.int32(u32))
            for i in range(size):
                totals[i] += flat[cells[i]]
        for i in range(size):
            scores[begin + i] = totals[i]
    return scores, blocked


@njit(cache=True, nogil=True)
def _cast(
    occupancy: Cells, resolution: float, x: float, y: float, angle: float, limit: float
) -> tuple[float, int]:
    """Distance at which a ray enters a cell that is not free, and the kind of hit.

    A ray that begins in occupied cells leaves them first: a mapped object at the lidar's own place
    is not there. x, y are relative to the grid's corner, metres. J. Amanatides, A. Woo, "A Fast
    Voxel Traversal Algorithm for Ray Tracing", Eurographics 1987.
    """
    rows, columns = occupancy.shape
    dx, dy = cos(angle), sin(angle)
    row, column = floor(y / resolution), floor(x / resolution)
    step_x, step_y = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    per_x = resolution / abs(dx) if dx != 0.0 else inf
    per_y = resolution / abs(dy) if dy != 0.0 else inf
    edge_x = (column + (1 if dx > 0.0 else 0)) * resolution
    edge_y = (row + (1 if dy > 0.0 else 0)) * resolution
    next_x = (edge_x - x) / dx if dx != 0.0 else inf
    next_y = (edge_y - y) / dy if dy != 0.0 else inf
    travelled, inside = 0.0, True
    while travelled <= limit:
        if row < 0 or column < 0 or row >= rows or column >= columns:
            return travelled, UNSEEN
        cell = occupancy[row, column]
        inside = inside and cell == 1
        if cell != 0 and not inside:
            return travelled, WALL if cell == 1 else UNSEEN
        if next_x < next_y:
            travelled = next_x
            next_x += per_x
            column += step_x
        else:
            travelled = next_y
            next_y += per_y
            row += step_y
    return limit, NOTHING


@njit(cache=True, nogil=True)
def cast_rays(
    occupancy: Cells,
    placement: Placement,
    sensor: FloatArray,
    angles: FloatArray,
    limit: float,
) -> FloatArray:
    """Ranges (m,) float64 that a lidar at `sensor` (x, y, heading) would measure on the map.

    +inf if no occupied cell is within `limit`, or if the ray leaves the known map.
    """
    resolution, origin_x, origin_y = placement
    ranges = np.empty(angles.shape[0])
    x, y = sensor[0] - origin_x, sensor[1] - origin_y
    for i in range(angles.shape[0]):
        distance, kind = _cast(occupancy, resolution, x, y, sensor[2] + angles[i], limit)
        ranges[i] = distance if kind == WALL else inf
    return ranges


@njit(cache=True, nogil=True)
def expected_ranges(
    occupancy: Cells, placement: Placement, sensors: FloatArray, angles: FloatArray, limit: float
) -> FloatArray:
    """Ranges (k, m) of beams of lidars at (k, 3) poses; +inf without a wall, NaN where unknown."""
    ranges = np.empty((sensors.shape[0], angles.shape[0]))
    for k in range(sensors.shape[0]):
        x, y = sensors[k, 0] - placement[1], sensors[k, 1] - placement[2]
        for i in range(angles.shape[0]):
            angle = sensors[k, 2] + angles[i]
            distance, kind = _cast(occupancy, placement[0], x, y, angle, limit)
            ranges[k, i] = distance if kind == WALL else (nan if kind == UNSEEN else inf)
    return ranges


@njit(cache=True, nogil=True)
def _distance(field: Floats, u: float, v: float) -> float:
    """Bilinear interpolation of the field at (u, v) cells from its corner, clamped to its edge."""
    rows, columns = field.shape
    u = min(max(u - 0.5, 0.0), columns - 1.001)
    v = min(max(v - 0.5, 0.0), rows - 1.001)
    column, row = int(u), int(v)
    fu, fv = u - column, v - row
    low = field[row, column] * (1.0 - fu) + field[row, column + 1] * fu
    high = field[row + 1, column] * (1.0 - fu) + field[row + 1, column + 1] * fu
    return float(low * (1.0 - fv) + high * fv)


@njit(cache=True, nogil=True)
def _through(
    occupancy: Cells,
    resolution: float,
    x: float,
    y: float,
    angle: float,
    limit: float,
    reach: float,
    margin: float,
) -> bool:
    """Return whether a beam of range `reach` passes a wall by more than `margin`, metres.

    It does for angle errors up to 0.03 rad and sideways errors up to one cell, as the edges of a
    map's cells have.
    """
    across_x, across_y = -sin(angle) * resolution, cos(angle) * resolution
    for side in range(-1, 2, 2):
        turned, kind = _cast(occupancy, resolution, x, y, angle + 0.03 * side, limit)
        if kind != WALL or reach <= turned + margin:
            return False
        beside_x, beside_y = x + side * across_x, y + side * across_y
        beside, kind = _cast(occupancy, resolution, beside_x, beside_y, angle, limit)
        if kind != WALL or reach <= beside + margin:
            return False
    return True


@njit(cache=True, nogil=True)
def classify_beams(
    occupancy: Cells,
    field: Floats,
    placement: Placement,
    sensor: FloatArray,
    angles: FloatArray,
    ranges: FloatArray,
    limit: float,
    deviation: float,
) -> tuple[NDArray[np.int8], FloatArray]:
    """Classify each beam of a scan against the map, for a lidar at `sensor` (x, y, heading).

    MATCHED ends at a wall; its credit is exp(-d²/(2 deviation²)) with the distance d to the wall.
    SHORT ends before a wall, at an unmapped obstacle. LONG passes a wall. MISSING has no return
    although a wall is in range. SILENT has no return, and no wall is in range. BEYOND ends in
    unknown space. IGNORED is invalid, or has no return from unknown space.

    Args:
        occupancy: 0 free, 1 occupied, 2 unknown.
        field: signed distance to the nearest surface, metres.
        placement: of both.
        sensor: x, y, heading in the map frame.
        angles: (m,) beam directions in the sensor frame.
        ranges: (m,) metres; +inf no return, NaN invalid.
        limit: the lidar's range_max, metres.
        deviation: metres.

    Returns:
        kinds (m,) int8 and credits (m,) float64.
    """
    resolution, origin_x, origin_y = placement
    count = angles.shape[0]
    margin = max(0.25, 3.0 * deviation)
    kinds = np.zeros(count, dtype=np.int8)
    credits = np.zeros(count)
    x, y = sensor[0] - origin_x, sensor[1] - origin_y
    for i in range(count):
        reach = ranges[i]
        if isnan(reach):
            continue
        angle = sensor[2] + angles[i]
        distance, kind = _cast(occupancy, resolution, x, y, angle, limit)
        if reach == inf:
            if kind == NOTHING:
                kinds[i] = SILENT
            elif kind == WALL and distance < limit - 0.5:
                kinds[i] = MISSING
            continue
        if kind == WALL and reach > distance + margin:
            if _through(occupancy, resolution, x, y, angle, limit, reach, margin):
                kinds[i] = LONG
                continue
        u = (x + reach * cos(angle)) / resolution
        v = (y + reach * sin(angle)) / resolution
        error = _distance(field, u, v)
        credit = exp(-0.5 * (error / deviation) ** 2)
        if credit > 0.1:
            kinds[i] = MATCHED
            credits[i] = credit
        elif kind != UNSEEN or reach < distance:
            kinds[i] = SHORT
        else:
            kinds[i] = BEYOND
    return kinds, credits


@njit(cache=True, nogil=True)
def add_residuals(
    field: Floats, placement: Placement, pose: FloatArray, points: FloatArray, deviation: float,
    h: FloatArray, g: FloatArray,
) -> None:  # fmt: skip
    """Add a Gauss-Newton step's terms of the points' distances to the map's surfaces.

    Geman-McClure weights reduce the influence of points far from any surface.

    Args:
        field: signed distance to the nearest surface, metres.
        placement: of the field.
        pose: (3,) of the base.
        points: (m, 2) in the base frame.
        deviation: residual in metres whose weight is a quarter.
        h: (3, 3) upper triangle of the normal equations h x = g; changed.
        g: (3,) likewise.
    """
    resolution, origin_x, origin_y = placement
    scale = 1.0 / resolution
    c, s = cos(pose[2]), sin(pose[2])
    for j in range(points.shape[0]):
        x = c * points[j, 0] - s * points[j, 1]
        y = s * points[j, 0] + c * points[j, 1]
        u = (pose[0] + x - origin_x) * scale
        v = (pose[1] + y - origin_y) * scale
        error = _distance(field, u, v)
        gx = (_distance(field, u + 0.5, v) - _distance(field, u - 0.5, v)) * scale
        gy = (_distance(field, u, v + 0.5) - _distance(field, u, v - 0.5)) * scale
        gh = gy * x - gx * y
        weight = 1.0 / (1.0 + (error / deviation) ** 2) ** 2
        h[0, 0] += weight * gx * gx
        h[0, 1] += weight * gx * gy
        h[0, 2] += weight * gx * gh
        h[1, 1] += weight * gy * gy
        h[1, 2] += weight * gy * gh
        h[2, 2] += weight * gh * gh
        g[0] -= weight * gx * error
        g[1] -= weight * gy * error
        g[2] -= weight * gh * error


@njit(cache=True, nogil=True)
def solve(h: FloatArray, g: FloatArray, least: float, damping: float) -> FloatArray:
    """Solve a symmetric positive definite 3x3 system by Cholesky.

    Args:
        h: (3, 3); its upper triangle counts.
        g: (3,).
        least: of a pivot.
        damping: added to the second and third element of the diagonal.
    """
    a = (h[0, 0] + least) ** 0.5
    b, d = h[0, 1] / a, h[0, 2] / a
    c = max(h[1, 1] + damping - b * b, least) ** 0.5
    e = (h[1, 2] - b * d) / c
    f = max(h[2, 2] + damping - d * d - e * e, least) ** 0.5
    p = g[0] / a
    q = (g[1] - b * p) / c
    r = (g[2] - d * p - e * q) / f
    solution = np.empty(3)
    solution[2] = r / f
    solution[1] = (q - e * solution[2]) / c
    solution[0] = (p - b * solution[1] - d * solution[2]) / a
    return solution


@njit(cache=True, nogil=True)
def object_costs(
    kinds: NDArray[np.int8], ranges: FloatArray, costs: FloatArray, limit: float, gap: float,
    least: int, angle: float, widest: float,
) -> FloatArray:  # fmt: skip
    """Costs of the objects that explain runs of adjacent beams of equal cost and similar range.

    Args:
        kinds: (m,) as of `classify_beams`.
        ranges: (m,) metres; +inf no return, NaN invalid.
        costs: (7,) cost of each kind of beam.
        limit: the lidar's range_max, metres.
        gap: metres between the ranges of adjacent beams that meet two objects.
        least: number of adjacent beams that an object has at least.
        angle: from beam to beam, as a multiple of the angle of an object of that cost.
        widest: root of the angle of the widest object in that unit; see `ScanEvaluator._cost`.

    Returns:
        (k,) costs of the k runs of at least `least` beams.
    """
    found, count, begin, before = np.empty(kinds.size), 0, 0, 0.0
    for beam in range(kinds.size + 1):
        reach = 0.0
        if beam < kinds.size and not isnan(ranges[beam]):
            reach = min(ranges[beam], limit) if ranges[beam] == inf else ranges[beam]
        if beam > 0 and (
            beam == kinds.size
            or costs[kinds[beam]] != costs[kinds[beam - 1]]
            or abs(reach - before) > gap
        ):
            if beam - begin >= least:
                size = (beam - begin) * angle
                found[count] = costs[kinds[begin]] * max(sqrt(size), size / widest)
                count += 1
            begin = beam
        before = reach
    return found[:count].copy()


LOCALISATION = (
    (expected_ranges, (u1[:, ::1], PLACEMENT, f8[:, ::1], f8[::1], f8)),
    (cast_rays, (u1[:, ::1], PLACEMENT, f8[::1], f8[::1], f8)),
    (
        classify_beams,
        (u1[:, ::1], f4[:, ::1], PLACEMENT, f8[::1], f8[::1], f8[::1], f8, f8),
    ),
    (object_costs, (i1[::1], f8[::1], f8[::1], f8, f8, i8, f8, f8)),
    (score_poses, (i2[:, ::1], u1[:, ::1], PLACEMENT, f8[:, ::1], f4[:, ::1])),
)
"""Entry points, with the types that the localiser calls them with."""
