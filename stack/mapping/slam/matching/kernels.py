"""Compiled loops of scan matching: normals, alignment, search.

Grids are (rows, columns) with row 0 at the smallest y; `origin` is the outer corner of cell (0, 0)
in metres. Poses are x, y, heading. Points are (m, 2), metres.
"""

from __future__ import annotations

from math import asin, atan2, ceil, cos, floor, pi, sin, sqrt
from typing import Any

import numpy as np
from numba import boolean, f8, i4, i8, u1

from stack.kernel_cache import njit
from stack.localisation.kernels import solve
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def scan_normals(
    points: FloatArray, sensor_x: float, sensor_y: float, reach: float, spread: float
) -> FloatArray:
    """(m, 2) unit normals towards the sensor, zero where no surface is seen.

    A normal is that of the line through the neighbouring points of the scan (principal component)
    within reach + spread · range, as far as they follow each other without a gap of that size.
    """
    count = points.shape[0]
    normals = np.zeros((count, 2))
    for i in range(count):
        px, py = points[i, 0], points[i, 1]
        limit = reach + spread * sqrt((px - sensor_x) ** 2 + (py - sensor_y) ** 2)
        n, sx, sy, sxx, sxy, syy = 1, 0.0, 0.0, 0.0, 0.0, 0.0
        for way in (-1, 1):
            lx, ly = px, py
            j = i + way
            while 0 <= j < count:
                qx, qy = points[j, 0], points[j, 1]
                if (qx - lx) ** 2 + (qy - ly) ** 2 > limit * limit:
                    break
                dx, dy = qx - px, qy - py
                if dx * dx + dy * dy > limit * limit:
                    break
                n += 1
                sx += dx
                sy += dy
                sxx += dx * dx
                sxy += dx * dy
                syy += dy * dy
                lx, ly = qx, qy
                j += way
        if n < 3:
            continue
        a, b, c = sxx / n - (sx / n) ** 2, sxy / n - sx * sy / n**2, syy / n - (sy / n) ** 2
        half, root = 0.5 * (a + c), sqrt((0.5 * (a - c)) ** 2 + b * b)
        if half - root > 0.1 * (half + root) or half + root < 1e-6:
            continue
        along = 0.5 * atan2(2.0 * b, a - c)
        nx, ny = -sin(along), cos(along)
        if nx * (sensor_x - px) + ny * (sensor_y - py) < 0.0:
            nx, ny = -nx, -ny
        normals[i, 0], normals[i, 1] = nx, ny
    return normals


@njit(cache=True, nogil=True)
def transform(pose: FloatArray, points: FloatArray, turn_only: bool) -> FloatArray:
    """(m, 2) points moved by a pose, or only turned by its heading."""
    c, s = cos(pose[2]), sin(pose[2])
    x, y = (0.0, 0.0) if turn_only else (pose[0], pose[1])
    moved = np.empty_like(points)
    for i in range(points.shape[0]):
        moved[i, 0] = x + c * points[i, 0] - s * points[i, 1]
        moved[i, 1] = y + s * points[i, 0] + c * points[i, 1]
    return moved


@njit(cache=True, nogil=True)
def rasterise(
    points: FloatArray, normals: FloatArray, placement: FloatArray, rows: int, columns: int
) -> tuple[Any, FloatArray]:
    """Average the points and normals of each cell of a grid; see `align_to_surfels`.

    Returns:
        (rows, columns) int32 row of the surfels, -1 in empty cells; (n, 4) surfels: mean position
        and mean normal, the latter zero where normals are missing or contradict each other.
    """
    index = np.full((rows, columns), -1, np.int32)
    surfels = np.zeros((points.shape[0], 4))
    counts = np.zeros(points.shape[0])
    used = 0
    for i in range(points.shape[0]):
        column = floor((points[i, 0] - placement[0]) / placement[2])
        row = floor((points[i, 1] - placement[1]) / placement[2])
        if row < 0 or column < 0 or row >= rows or column >= columns:
            continue
        k = index[row, column]
        if k < 0:
            k = used
            index[row, column] = k
            used += 1
        counts[k] += 1.0
        surfels[k, 0] += points[i, 0]
        surfels[k, 1] += points[i, 1]
        surfels[k, 2] += normals[i, 0]
        surfels[k, 3] += normals[i, 1]
    for k in range(used):
        surfels[k, 0] /= counts[k]
        surfels[k, 1] /= counts[k]
        length = sqrt(surfels[k, 2] ** 2 + surfels[k, 3] ** 2)
        if length < 0.5 * counts[k]:
            surfels[k, 2], surfels[k, 3] = 0.0, 0.0
        else:
            surfels[k, 2] /= length
            surfels[k, 3] /= length
    return index, surfels[:used].copy()


@njit(cache=True, nogil=True)
def _add_residual(
    h: FloatArray, g: FloatArray, ux: float, uy: float, rx: float, ry: float, residual: float,
    deviation: float,
) -> float:  # fmt: skip
    """Add a point-to-line residual, metres, to h x = g; return its Geman-McClure weight.

    A. Censi, "An ICP variant using a point-to-line metric", ICRA 2008. (ux, uy) is the normal of
    the line, (rx, ry) the point seen from the base; both in the axes of the reference.
    """
    w = 1.0 / (1.0 + (residual / (3.0 * deviation)) ** 2)
    w = w * w
    j2 = -ux * ry + uy * rx
    h[0, 0] += w * ux * ux
    h[0, 1] += w * ux * uy
    h[0, 2] += w * ux * j2
    h[1, 1] += w * uy * uy
    h[1, 2] += w * uy * j2
    h[2, 2] += w * j2 * j2
    g[0] -= w * ux * residual
    g[1] -= w * uy * residual
    g[2] -= w * j2 * residual
    return w


@njit(cache=True, nogil=True)
def _move(pose: FloatArray, h: FloatArray, g: FloatArray) -> bool:
    """Move a pose by the solution of the normal equations; return whether it hardly moves."""
    by = solve(h, g, 1e-9, 0.0)
    for i in range(3):
        pose[i] += by[i]
    return bool(abs(by[0]) + abs(by[1]) < 1e-4 and abs(by[2]) < 1e-4)


@njit(cache=True, nogil=True)
def align_to_surfels(
    labels: Any, surfels: FloatArray, placement: FloatArray, points: FloatArray,
    normals: FloatArray, start: FloatArray, expected: FloatArray, prior: FloatArray, reach: float,
    deviation: float, iterations: int,
) -> tuple[FloatArray, FloatArray, float]:  # fmt: skip
    """Align a scan to surfels with point-to-line residuals.

    Args:
        labels: (rows, columns) int32, the nearest surfel of each cell.
        surfels: (n, 4) positions and unit normals.
        placement: origin x, origin y, resolution of `labels`.
        points: of the scan, base frame.
        normals: of the scan, base frame.
        start: initial pose.
        expected: pose by odometry.
        prior: (3, 3) information of `expected`, in units of 1 / deviation².
        reach: largest distance of corresponding points; at first 4 times that.
        deviation: metres, of residuals.
        iterations: at most.

    Returns:
        The pose, (3, 3) information in the base frame without the prior, share of the points with
        normals that have a correspondence.
    """
    rows, columns = labels.shape
    pose, h, g, share = start.copy(), np.zeros((3, 3)), np.zeros(3), 0.0
    for step in range(iterations):
        limit = reach * max(1.0, 4.0 - step)
        c, s = cos(pose[2]), sin(pose[2])
        h[:], g[:] = 0.0, 0.0
        matched, total = 0.0, 0
        for i in range(points.shape[0]):
            nx = c * normals[i, 0] - s * normals[i, 1]
            ny = s * normals[i, 0] + c * normals[i, 1]
            if nx == 0.0 and ny == 0.0:
                continue
            total += 1
            rx, ry = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
            px, py = pose[0] + rx, pose[1] + ry
            column = floor((px - placement[0]) / placement[2])
            row = floor((py - placement[1]) / placement[2])
            if row < 0 or column < 0 or row >= rows or column >= columns:
                continue
            k = labels[row, column]
            if k < 0:
                continue
            ux, uy = surfels[k, 2], surfels[k, 3]
            if ux * nx + uy * ny < 0.7:
                continue
            dx, dy = px - surfels[k, 0], py - surfels[k, 1]
            if dx * dx + dy * dy > limit * limit:
                continue
            matched += _add_residual(h, g, ux, uy, rx, ry, ux * dx + uy * dy, deviation)
        h[1, 0], h[2, 0], h[2, 1] = h[0, 1], h[0, 2], h[1, 2]
        share = matched / max(1, total)
        ex, ey = pose[0] - expected[0], pose[1] - expected[1]
        eh = (pose[2] - expected[2] + pi) % (2.0 * pi) - pi
        for k in range(3):
            g[k] -= prior[k, 0] * ex + prior[k, 1] * ey + prior[k, 2] * eh
        if _move(pose, h + prior, g) and step > 3:
            break
    return pose, _in_base(h, pose[2]) / deviation**2, share


@njit(cache=True, nogil=True)
def _in_base(hessian: FloatArray, heading: float) -> FloatArray:
    """Turn an information matrix from the axes of the frame to those of the base."""
    c, s = cos(heading), sin(heading)
    a, b, d = hessian[0, 0], hessian[0, 1], hessian[1, 1]
    turned = np.empty((3, 3))
    turned[0, 0] = c * c * a + 2.0 * c * s * b + s * s * d
    turned[0, 1] = c * s * (d - a) + (c * c - s * s) * b
    turned[1, 1] = s * s * a - 2.0 * c * s * b + c * c * d
    turned[0, 2] = c * hessian[0, 2] + s * hessian[1, 2]
    turned[1, 2] = -s * hessian[0, 2] + c * hessian[1, 2]
    turned[2, 2] = hessian[2, 2]
    turned[1, 0], turned[2, 0], turned[2, 1] = turned[0, 1], turned[0, 2], turned[1, 2]
    return turned


@njit(cache=True, nogil=True)
def align_pair(
    fixed: FloatArray, fixed_normals: FloatArray, bearings: FloatArray, sensor: FloatArray,
    points: FloatArray, normals: FloatArray, start: FloatArray, reach: float, deviation: float,
    iterations: int,
) -> tuple[FloatArray, FloatArray, float]:  # fmt: skip
    """Align a scan to another one: as `align_to_surfels` with exact nearest neighbours, no prior.

    Args:
        fixed: (n, 2) points of the other scan in the order of its beams.
        fixed_normals: of these points.
        bearings: (n,) of these points from their sensor, ascending, radians; may exceed π.
        sensor: position of that sensor, same frame as `fixed`.
        points: as of `align_to_surfels`; the residual is along the mean of both normals.
        normals: likewise.
        start: likewise.
        reach: likewise; at first 3 times that.
        deviation: likewise.
        iterations: likewise.
    """
    pose, h, g, share = start.copy(), np.zeros((3, 3)), np.zeros(3), 0.0
    for step in range(iterations):
        limit = reach * max(1.0, 3.0 - step)
        c, s = cos(pose[2]), sin(pose[2])
        h[:], g[:] = 0.0, 0.0
        matched, total = 0.0, 0
        for i in range(points.shape[0]):
            nx = c * normals[i, 0] - s * normals[i, 1]
            ny = s * normals[i, 0] + c * normals[i, 1]
            if nx == 0.0 and ny == 0.0:
                continue
            total += 1
            rx, ry = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
            px, py = pose[0] + rx, pose[1] + ry
            best, k = limit * limit, -1
            vx, vy = px - sensor[0], py - sensor[1]
            away = sqrt(vx * vx + vy * vy)
            # Points within the limit are within this angle as seen from the sensor.
            width = asin(limit / away) if away > limit else pi
            bearing = atan2(vy, vx)
            for turn in (-2.0 * pi, 0.0, 2.0 * pi):
                first = np.searchsorted(bearings, bearing + turn - width)
                for j in range(first, fixed.shape[0]):
                    if bearings[j] > bearing + turn + width:
                        break
                    d = (px - fixed[j, 0]) ** 2 + (py - fixed[j, 1]) ** 2
                    if d < best and fixed_normals[j, 0] * nx + fixed_normals[j, 1] * ny >= 0.7:
                        best, k = d, j
            if k < 0:
                continue
            ux, uy = fixed_normals[k, 0] + nx, fixed_normals[k, 1] + ny
            length = sqrt(ux * ux + uy * uy)
            ux, uy = ux / length, uy / length
            residual = ux * (px - fixed[k, 0]) + uy * (py - fixed[k, 1])
            matched += _add_residual(h, g, ux, uy, rx, ry, residual, deviation)
        h[1, 0], h[2, 0], h[2, 1] = h[0, 1], h[0, 2], h[1, 2]
        share = matched / max(1, total)
        # A direction that the scans do not determine keeps its start value.
        if _move(pose, h + 1e-2 * np.eye(3), g) and step > 3:
            break
    return pose, _in_base(h, pose[2]) / deviation**2, share


@njit(cache=True, nogil=True)
def _bound(scores: Any, cells: Any, dy: int, dx: int, side: int) -> int:
    """Sum of the scores (rows, columns) at cells (n, 2) moved by dy, dx.

    A score is the largest of the block of `side` cells that begins there. Blocks that begin before
    the grid may reach into it.
    """
    rows, columns = scores.shape
    total = 0
    for i in range(cells.shape[0]):
        row, column = cells[i, 0] + dy, cells[i, 1] + dx
        if row < 0:
            row = 0 if row > -side else -1
        if column < 0:
            column = 0 if column > -side else -1
        if row >= 0 and column >= 0 and row < rows and column < columns:
            total += scores[row, column]
    return total


@njit(cache=True, nogil=True)
def search(
    pyramid: Any, points: FloatArray, placement: FloatArray, centre: FloatArray,
    window: FloatArray, angle_step: float, penalties: FloatArray, least: float, most_nodes: int,
) -> tuple[FloatArray, float]:  # fmt: skip
    """Find the pose with the best mean score by branch and bound.

    W. Hess et al., "Real-Time Loop Closure in 2D LIDAR SLAM", ICRA 2016.

    Args:
        pyramid: (levels, rows, columns) uint8; level h holds at each cell the largest score of the
            2^h × 2^h cells from there on.
        points: base frame.
        placement: origin x, origin y, resolution.
        centre: pose in the middle of the window.
        window: half width in x and y (metres), and in heading (radians).
        angle_step: radians.
        penalties: score lost per squared metre and per squared radian from the centre.
        least: scores below this, in [0, 1], are not sought.
        most_nodes: evaluations of a node at most.

    Returns:
        The best pose, and its score (-1 if there is none).
    """
    levels = pyramid.shape[0]
    resolution, top = placement[2], levels - 1
    reach = ceil(window[0] / resolution)
    turns = ceil(window[1] / angle_step)
    count = points.shape[0]
    best, best_pose = least, np.array([centre[0], centre[1], centre[2]])
    found, nodes = False, 0
    stride = 1 << top
    side = (2 * reach) // stride + 1
    scale = 1.0 / (255.0 * max(1, count))
    cells = np.empty((2 * turns + 1, count, 2), np.int32)
    roots = (2 * turns + 1) * side * side
    bounds, entries = np.empty(roots), np.empty((roots, 3), np.int32)
    base = 0
    for a in range(2 * turns + 1):
        angle = centre[2] + (a - turns) * angle_step
        c, s = cos(angle), sin(angle)
        for i in range(count):
            u = centre[0] + c * points[i, 0] - s * points[i, 1] - placement[0]
            v = centre[1] + s * points[i, 0] + c * points[i, 1] - placement[1]
            cells[a, i, 0], cells[a, i, 1] = floor(v / resolution), floor(u / resolution)
        for p in range(side):
            for q in range(side):
                dy, dx = -reach + p * stride, -reach + q * stride
                bounds[base] = _bound(pyramid[top], cells[a], dy, dx, stride) * scale
                entries[base, 0], entries[base, 1], entries[base, 2] = a, dy, dx
                base += 1
    order = np.argsort(-bounds[:base])
    stack = np.empty((4 * (levels + 1), 4), np.int32)
    values = np.empty(4 * (levels + 1))
    children = np.empty((4, 4), np.int32)
    scores = np.empty(4)
    for o in order:
        if bounds[o] <= best or nodes > most_nodes:
            break
        depth = 1
        stack[0, 0], stack[0, 1], stack[0, 2] = entries[o, 0], entries[o, 1], entries[o, 2]
        stack[0, 3] = top
        values[0] = bounds[o]
        while depth > 0:
            depth -= 1
            if values[depth] <= best:
                continue
            a, dy, dx, level = stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3]
            if level == 0:
                turned = (a - turns) * angle_step
                lost = penalties[0] * resolution**2 * (dx * dx + dy * dy)
                score = values[depth] - lost - penalties[1] * turned**2
                if score > best:
                    best, found = score, True
                    best_pose[0] = centre[0] + dx * resolution
                    best_pose[1] = centre[1] + dy * resolution
                    best_pose[2] = centre[2] + turned
                continue
            half = 1 << (level - 1)
            kept = 0
            for child in range(4):
                ny, nx = dy + half * (child >> 1), dx + half * (child & 1)
                if ny > reach or nx > reach:
                    continue
                nodes += 1
                value = _bound(pyramid[level - 1], cells[a], ny, nx, half) * scale
                if value <= best:
                    continue
                at = kept  # ascending: the best child is taken from the stack first
                while at > 0 and scores[at - 1] > value:
                    scores[at] = scores[at - 1]
                    children[at] = children[at - 1]
                    at -= 1
                scores[at] = value
                children[at, 0], children[at, 1], children[at, 2] = a, ny, nx
                children[at, 3] = level - 1
                kept += 1
            for k in range(kept):
                stack[depth], values[depth] = children[k], scores[k]
                depth += 1
    return best_pose, (best if found else -1.0)


_floats, _plane = f8[::1], f8[:, ::1]
ENTRY_POINTS = (
    (scan_normals, (_plane, f8, f8, f8, f8)),
    (transform, (_floats, _plane, boolean)),
    (rasterise, (_plane, _plane, _floats, i8, i8)),
    (
        align_to_surfels,
        (i4[:, ::1], _plane, _floats, _plane, _plane, _floats, _floats, _plane, f8, f8, i8),
    ),
    (align_pair, (_plane, _plane, _floats, _floats, _plane, _plane, _floats, f8, f8, i8)),
    (search, (u1[:, :, ::1], _plane, _floats, _floats, _floats, f8, _floats, f8, i8)),
)
"""Kernels of scan matching, with the types of their arguments."""
