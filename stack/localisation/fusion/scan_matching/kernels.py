"""Compiled loops of scan matching: points of a scan, lines of a keyframe, alignment, search.

Points are (n, 2) in a base frame, metres. A keyframe has for each point the line through its
neighbours: `lines`, (n, 5): a point on the line, its unit normal, the variance of the normal's
direction (rad²; negative: no line). `nearest` (cells, cells) holds the number of the nearest point
within REACH, or -1; the base is in the middle of the grid.
"""

from __future__ import annotations

from math import cos, floor, isfinite, pi, sin

import numpy as np
from numba import f4, f8, i4, i8
from numpy.typing import NDArray

from stack.kernel_cache import njit
from stack.types import FloatArray

Floats = NDArray[np.float32]
Indices = NDArray[np.int32]

CELL, REACH = 0.1, 0.3
"""Side of a cell of `nearest`, and distance up to which a point has correspondences, metres."""

NEIGHBOURS = 12
"""Beams on each side that may belong to the line through a point."""


@njit(cache=True, nogil=True)
def scan_points(
    ranges: Floats, angles: FloatArray, begin: float, increment: float, farthest: float,
    mount: FloatArray, trail: FloatArray,
) -> FloatArray:  # fmt: skip
    """End points of the beams in the base frame at the scan's stamp, (n, 2), in order of beams.

    Args:
        ranges: (n,) metres; others than (0, farthest] are left out.
        angles: (n,) directions in the sensor frame.
        begin: stamp of the first beam.
        increment: seconds from beam to beam.
        farthest: metres.
        mount: (3,) of the sensor in the base frame.
        trail: (m, 4) stamp and pose of the base, in order; the poses are in the base frame at the
            scan's stamp and its stamps cover the scan.
    """
    points = np.empty((ranges.size, 2))
    count, knot = 0, 0
    mc, ms = cos(mount[2]), sin(mount[2])
    for i in range(ranges.size):
        r = ranges[i]
        if not isfinite(r) or r <= 0.0 or r > farthest:
            continue
        bx, by = r * cos(angles[i]), r * sin(angles[i])
        x, y = mount[0] + mc * bx - ms * by, mount[1] + ms * bx + mc * by
        stamp = begin + increment * i
        while knot < trail.shape[0] - 2 and trail[knot + 1, 0] < stamp:
            knot += 1
        first, second = trail[knot], trail[min(knot + 1, trail.shape[0] - 1)]
        span = second[0] - first[0]
        share = (stamp - first[0]) / span if span > 0.0 else 0.0
        share = min(max(share, 0.0), 1.0)
        turn = (second[3] - first[3] + pi) % (2.0 * pi) - pi
        heading = first[3] + share * turn
        c, s = cos(heading), sin(heading)
        points[count, 0] = first[1] + share * (second[1] - first[1]) + c * x - s * y
        points[count, 1] = first[2] + share * (second[2] - first[2]) + s * x + c * y
        count += 1
    return points[:count].copy()


@njit(cache=True, nogil=True)
def fit_lines(points: FloatArray, radius: float, deviation: float) -> FloatArray:
    """Fit a line to the neighbours of each point: (n, 5), see the module.

    Args:
        points: in the order of the beams.
        radius: of the neighbourhood, metres.
        deviation: of a point from its line, metres.
    """
    n = points.shape[0]
    lines = np.zeros((n, 5))
    for i in range(n):
        lines[i, 4] = -1.0
        count, sx, sy, sxx, sxy, syy = 0, 0.0, 0.0, 0.0, 0.0, 0.0
        for step in range(-NEIGHBOURS, NEIGHBOURS + 1):
            j = (i + step) % n
            dx, dy = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1]
            if dx * dx + dy * dy <= radius * radius:
                count += 1
                sx += dx
                sy += dy
                sxx += dx * dx
                sxy += dx * dy
                syy += dy * dy
        if count < 4:
            continue
        sx, sy = sx / count, sy / count
        a, b, d = sxx / count - sx * sx, sxy / count - sx * sy, syy / count - sy * sy
        root = (0.25 * (a - d) * (a - d) + b * b) ** 0.5
        small, large = 0.5 * (a + d) - root, 0.5 * (a + d) + root
        if large <= 0.0 or small > 4.0 * deviation * deviation or small > 0.05 * large:
            continue
        nx, ny = b, small - a
        if abs(a - small) < abs(d - small):
            nx, ny = small - d, b
        length = (nx * nx + ny * ny) ** 0.5
        if length == 0.0:
            continue
        lines[i, 0], lines[i, 1] = points[i, 0] + sx, points[i, 1] + sy
        lines[i, 2], lines[i, 3] = nx / length, ny / length
        lines[i, 4] = max(small, deviation * deviation) / (count * large)
    return lines


@njit(cache=True, nogil=True)
def nearest_points(points: FloatArray, cells: int) -> Indices:
    """Number of the nearest point of each cell, (cells, cells); -1 beyond REACH."""
    nearest = np.full((cells, cells), -1, np.int32)
    best = np.full((cells, cells), np.float32(REACH * REACH))
    around = int(REACH / CELL) + 1
    half = 0.5 * cells * CELL
    for i in range(points.shape[0]):
        column = floor((points[i, 0] + half) / CELL)
        row = floor((points[i, 1] + half) / CELL)
        for r in range(max(0, row - around), min(cells, row + around + 1)):
            dy = (r + 0.5) * CELL - half - points[i, 1]
            for c in range(max(0, column - around), min(cells, column + around + 1)):
                dx = (c + 0.5) * CELL - half - points[i, 0]
                if dx * dx + dy * dy < best[r, c]:
                    best[r, c] = dx * dx + dy * dy
                    nearest[r, c] = i
    return nearest


@njit(cache=True, nogil=True)
def _correspondence(nearest: Indices, half: float, x: float, y: float) -> int:
    column, row = floor((x + half) / CELL), floor((y + half) / CELL)
    if row < 0 or column < 0 or row >= nearest.shape[0] or column >= nearest.shape[1]:
        return -1
    return int(nearest[row, column])


@njit(cache=True, nogil=True)
def share_explained(
    points: FloatArray, keyframe: FloatArray, lines: FloatArray, nearest: Indices,
    pose: FloatArray, tolerance: float,
) -> float:  # fmt: skip
    """Share of the points that lie on the keyframe's lines within a tolerance, in [0, 1]."""
    half, hits = 0.5 * nearest.shape[0] * CELL, 0
    c, s = cos(pose[2]), sin(pose[2])
    for i in range(points.shape[0]):
        x = pose[0] + c * points[i, 0] - s * points[i, 1]
        y = pose[1] + s * points[i, 0] + c * points[i, 1]
        j = _correspondence(nearest, half, x, y)
        if j < 0:
            continue
        if lines[j, 4] < 0.0:
            away = ((x - keyframe[j, 0]) ** 2 + (y - keyframe[j, 1]) ** 2) ** 0.5
            hits += away < 2.0 * tolerance
        else:
            away = (x - lines[j, 0]) * lines[j, 2] + (y - lines[j, 1]) * lines[j, 3]
            hits += abs(away) < tolerance
    return hits / points.shape[0] if points.shape[0] else 0.0


@njit(cache=True, nogil=True)
def align(
    points: FloatArray, lines: FloatArray, nearest: Indices, start: FloatArray, deviation: float,
    weakest: float, iterations: int,
) -> tuple[FloatArray, FloatArray, bool]:  # fmt: skip
    """Align points with the lines of a keyframe: point-to-line Gauss-Newton, Cauchy weights.

    A. Censi, "An ICP variant using a point-to-line metric", ICRA 2008. Directions whose deviation
    would exceed `weakest` keep the start (J. Zhang, M. Kaess, S. Singh, "On degeneracy of
    optimization-based state estimation problems", ICRA 2016). Errors of the normals seem to fix the
    position along a corridor; their expected share of the information is subtracted.

    Args:
        points: of the scan, base frame.
        lines: of the keyframe.
        nearest: of the keyframe.
        start: (3,) pose of the base in the frame of the keyframe.
        deviation: of a point from its line, metres.
        weakest: metres.
        iterations: at most.

    Returns:
        The pose (3,), its covariance (3, 3) in the frame of the keyframe (large in directions
        without information), and whether the iteration converged.
    """
    pose, half = start.copy(), 0.5 * nearest.shape[0] * CELL
    arm, information, converged = 1.0, np.zeros((3, 3)), False
    spread = np.eye(3)
    for iteration in range(iterations):
        information[:], false = 0.0, np.zeros((3, 3))
        gradient = np.zeros(3)
        c, s = cos(pose[2]), sin(pose[2])
        arms, used = 0.0, 0
        for i in range(points.shape[0]):
            px, py = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
            j = _correspondence(nearest, half, pose[0] + px, pose[1] + py)
            if j < 0 or lines[j, 4] < 0.0:
                continue
            nx, ny = lines[j, 2], lines[j, 3]
            away = (pose[0] + px - lines[j, 0]) * nx + (pose[1] + py - lines[j, 1]) * ny
            weight = 1.0 / (1.0 + (away / (3.0 * deviation)) ** 2)
            weight = weight / (deviation * deviation)
            row = (nx, ny, ny * px - nx * py)
            slip = (-ny, nx, nx * px + ny * py)
            for a in range(3):
                gradient[a] -= weight * row[a] * away
                for b in range(3):
                    information[a, b] += weight * row[a] * row[b]
                    false[a, b] += weight * lines[j, 4] * slip[a] * slip[b]
            arms += (px * px + py * py) ** 0.5
            used += 1
        if used < 10:
            return pose, np.eye(3) * 1e4, False
        arm = max(arms / used, 0.5)
        for a in range(3):
            for b in range(3):
                factor = (1.0 / arm if a == 2 else 1.0) * (1.0 / arm if b == 2 else 1.0)
                information[a, b] = (information[a, b] - false[a, b]) * factor
        gradient[2] /= arm
        values, vectors = _eigen(information)
        step = np.zeros(3)
        spread[:] = 0.0
        for k in range(3):
            known = values[k] > 1.0 / (weakest * weakest)
            along = 0.0
            for a in range(3):
                along += vectors[a, k] * gradient[a]
            for a in range(3):
                if known:
                    step[a] += vectors[a, k] * along / values[k]
                for b in range(3):
                    spread[a, b] += (
                        vectors[a, k] * vectors[b, k] * (1.0 / values[k] if known else 1e2)
                    )
        step[2] /= arm
        # Correspondences change in steps: shorter steps end a cycle between two of them.
        damping = 1.0 if iteration < iterations // 2 else 0.5
        for a in range(3):
            pose[a] += damping * step[a]
        converged = abs(step[0]) + abs(step[1]) < 0.5 * deviation and abs(step[2]) < 1e-3
        if abs(step[0]) + abs(step[1]) < 2e-4 and abs(step[2]) < 1e-4:
            break
    for a in range(3):
        spread[a, 2] /= arm
    for b in range(3):
        spread[2, b] /= arm
    pose[2] = (pose[2] + pi) % (2.0 * pi) - pi
    return pose, spread, converged


@njit(cache=True, nogil=True)
def _eigen(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues (3,) and eigenvectors (columns) of a symmetric (3, 3) matrix, Jacobi's method."""
    a, vectors = matrix.copy(), np.eye(3)
    for _ in range(12):
        off = abs(a[0, 1]) + abs(a[0, 2]) + abs(a[1, 2])
        if off < 1e-12 * (abs(a[0, 0]) + abs(a[1, 1]) + abs(a[2, 2])):
            break
        for p in range(2):
            for q in range(p + 1, 3):
                if a[p, q] == 0.0:
                    continue
                ratio = (a[q, q] - a[p, p]) / (2.0 * a[p, q])
                sign = 1.0 if ratio >= 0.0 else -1.0
                t = sign / (abs(ratio) + (ratio * ratio + 1.0) ** 0.5)
                c = 1.0 / (t * t + 1.0) ** 0.5
                s = t * c
                for k in range(3):
                    one, two = a[k, p], a[k, q]
                    a[k, p], a[k, q] = c * one - s * two, s * one + c * two
                for k in range(3):
                    one, two = a[p, k], a[q, k]
                    a[p, k], a[q, k] = c * one - s * two, s * one + c * two
                for k in range(3):
                    one, two = vectors[k, p], vectors[k, q]
                    vectors[k, p], vectors[k, q] = c * one - s * two, s * one + c * two
    return np.array([a[0, 0], a[1, 1], a[2, 2]]), vectors


@njit(cache=True, nogil=True)
def search(
    points: FloatArray, keyframe: FloatArray, nearest: Indices, centre: FloatArray,
    distance: float, angle: float, step: float, turn: float, best: int,
) -> FloatArray:  # fmt: skip
    """Poses around a centre at which the points lie near those of the keyframe, best first.

    Args:
        points: of the scan, base frame.
        keyframe: points of the keyframe.
        nearest: of the keyframe.
        centre: (3,) pose of the base in the frame of the keyframe.
        distance: half the side of the window, metres.
        angle: half its angle, radians.
        step: between positions, metres.
        turn: between headings, radians.
        best: number of poses returned; they differ by more than one step.

    Returns:
        (m, 4): x, y, heading, mean closeness in [0, 1].
    """
    sides, turns = int(distance / step), int(angle / turn)
    width = 2 * sides + 1
    half = 0.5 * nearest.shape[0] * CELL
    scores = np.zeros((2 * turns + 1, width, width), np.float32)
    for k in range(2 * turns + 1):
        heading = centre[2] + (k - turns) * turn
        c, s = cos(heading), sin(heading)
        for i in range(points.shape[0]):
            px = centre[0] + c * points[i, 0] - s * points[i, 1]
            py = centre[1] + s * points[i, 0] + c * points[i, 1]
            for a in range(width):
                x = px + (a - sides) * step
                for b in range(width):
                    y = py + (b - sides) * step
                    j = _correspondence(nearest, half, x, y)
                    if j >= 0:
                        away = (x - keyframe[j, 0]) ** 2 + (y - keyframe[j, 1]) ** 2
                        scores[k, a, b] += max(0.0, 1.0 - away / (REACH * REACH))
    found = np.empty((best, 4))
    count = 0
    while count < best:
        top, where = np.float32(0.0), (0, 0, 0)
        for k in range(2 * turns + 1):
            for a in range(width):
                for b in range(width):
                    if scores[k, a, b] > top:
                        top, where = scores[k, a, b], (k, a, b)
        if top <= 0.0:
            break
        k, a, b = where
        found[count, 0] = centre[0] + (a - sides) * step
        found[count, 1] = centre[1] + (b - sides) * step
        found[count, 2] = centre[2] + (k - turns) * turn
        found[count, 3] = top / points.shape[0]
        count += 1
        for kk in range(max(0, k - 1), min(2 * turns, k + 1) + 1):
            for aa in range(max(0, a - 1), min(width - 1, a + 1) + 1):
                for bb in range(max(0, b - 1), min(width - 1, b + 1) + 1):
                    scores[kk, aa, bb] = 0.0
    return found[:count].copy()


_POINTS, _VECTOR, _CELLS = f8[:, ::1], f8[::1], i4[:, ::1]
MATCHING = (
    (scan_points, (f4[::1], _VECTOR, f8, f8, f8, _VECTOR, _POINTS)),
    (fit_lines, (_POINTS, f8, f8)),
    (nearest_points, (_POINTS, i8)),
    (share_explained, (_POINTS, _POINTS, _POINTS, _CELLS, _VECTOR, f8)),
    (align, (_POINTS, _POINTS, _CELLS, _VECTOR, f8, f8, i8)),
    (search, (_POINTS, _POINTS, _CELLS, _VECTOR, f8, f8, f8, f8, i8)),
)
"""What scan matching calls, with the types."""
