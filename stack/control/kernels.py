"""Compiled loops of path following: projection, lookahead point, swept footprint."""

from __future__ import annotations

from math import cos, floor, hypot, inf, sin, sqrt

import numpy as np
from numba import njit

from stack.types import FloatArray

LETHAL = 254
HIGHEST_PASSABLE = 252


@njit(cache=True, nogil=True)
def project(
    points: FloatArray, lengths: FloatArray, x: float, y: float, first: int, reach: float
) -> tuple[int, float, float]:
    """Project a point onto a polyline, within `reach` metres of length after vertex `first`.

    Args:
        points: (n, 2) vertices, metres, n >= 2.
        lengths: (n,) length of the polyline up to each vertex, metres.
        x: of the point to project, in the frame of the polyline, metres.
        y: of the same point, metres.
        first: vertex to begin at.
        reach: metres beyond that vertex to search.

    Returns:
        First vertex of the nearest segment, length up to the projection, distance to it (m).
    """
    best, best_segment, best_length = inf, first, lengths[first]
    for i in range(first, points.shape[0] - 1):
        if lengths[i] > lengths[first] + reach:
            break
        dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        square = dx * dx + dy * dy
        share = 0.0
        if square > 0.0:
            share = ((x - points[i, 0]) * dx + (y - points[i, 1]) * dy) / square
            share = min(1.0, max(0.0, share))
        distance = hypot(points[i, 0] + share * dx - x, points[i, 1] + share * dy - y)
        if distance < best:
            best, best_segment = distance, i
            best_length = lengths[i] + share * sqrt(square)
    return best_segment, best_length, best


@njit(cache=True, nogil=True)
def length_at_distance(
    points: FloatArray, lengths: FloatArray, x: float, y: float, length: float, distance: float
) -> float:
    """Length up to the first point of a polyline after `length` that is `distance` from (x, y).

    Returns the length of the polyline when there is no such point, and `length` plus `distance`
    when the polyline at `length` is already farther away.

    Args:
        points: (n, 2) vertices, metres.
        lengths: (n,) length of the polyline up to each vertex, metres.
        x: of the point to measure from, metres.
        y: of the same point, metres.
        length: position on the polyline to begin at, metres.
        distance: straight-line distance, metres.
    """
    n = points.shape[0]
    i = min(np.searchsorted(lengths, length, side="right"), n - 1)
    span = lengths[i] - lengths[i - 1]
    share = (length - lengths[i - 1]) / span if span > 0.0 else 0.0
    ax = points[i - 1, 0] + share * (points[i, 0] - points[i - 1, 0])
    ay = points[i - 1, 1] + share * (points[i, 1] - points[i - 1, 1])
    if hypot(ax - x, ay - y) >= distance:
        return min(length + distance, float(lengths[n - 1]))
    begin = length
    for j in range(i, n):
        bx, by = points[j, 0], points[j, 1]
        if hypot(bx - x, by - y) >= distance:
            dx, dy = bx - ax, by - ay
            fx, fy = ax - x, ay - y
            a = dx * dx + dy * dy
            b = fx * dx + fy * dy
            c = fx * fx + fy * fy - distance * distance
            share = (-b + sqrt(max(0.0, b * b - a * c))) / a
            return float(begin + share * (lengths[j] - begin))
        ax, ay, begin = bx, by, float(lengths[j])
    return float(lengths[n - 1])


@njit(cache=True, nogil=True)
def _holds(corners: FloatArray, x: float, y: float) -> bool:
    """Whether a polygon (n, 2) contains a point: a ray to +x crosses an odd number of edges."""
    within = False
    for i in range(corners.shape[0]):
        ay, by = corners[i - 1, 1], corners[i, 1]
        if (ay > y) != (by > y):
            ax, bx = corners[i - 1, 0], corners[i, 0]
            within ^= x < ax + (y - ay) * (bx - ax) / (by - ay)
    return within


@njit(cache=True, nogil=True)
def _first_lethal(
    cells: np.ndarray, resolution: float, origin_x: float, origin_y: float,
    body: FloatArray, corners: FloatArray, x: float, y: float, heading: float, known: np.ndarray,
    count: int, first: int,
) -> tuple[int, int]:  # fmt: skip
    """Find the first footprint point, from index `first` on, over a lethal cell not in `known`.

    Returns:
        Index of the point (-1: none), and the number of the cell, row * columns + column.
    """
    c, s = cos(heading), sin(heading)
    rows, columns = cells.shape
    for i in range(first, body.shape[0]):
        px = x + c * body[i, 0] - s * body[i, 1]
        py = y + s * body[i, 0] + c * body[i, 1]
        row = floor((py - origin_y) / resolution)
        column = floor((px - origin_x) / resolution)
        if 0 <= row < rows and 0 <= column < columns and cells[row, column] == LETHAL:
            cx = origin_x + (column + 0.5) * resolution - x
            cy = origin_y + (row + 0.5) * resolution - y
            if not _holds(corners, c * cx + s * cy, c * cy - s * cx):
                continue
            number = row * columns + column
            new = True
            for j in range(count):
                if known[j] == number:
                    new = False
                    break
            if new:
                return i, number
    return -1, -1


@njit(cache=True, nogil=True)
def _covered(
    cells: np.ndarray, resolution: float, origin_x: float, origin_y: float,
    body: FloatArray, corners: FloatArray, x: float, y: float, heading: float,
) -> tuple[np.ndarray, int]:  # fmt: skip
    """Return the numbers of the lethal cells under the footprint, and their count."""
    known = np.empty(body.shape[0], np.int64)
    count = 0
    place, cell = _first_lethal(
        cells, resolution, origin_x, origin_y, body, corners, x, y, heading, known, count, 0
    )
    while place >= 0:
        known[count] = cell
        count += 1
        place, cell = _first_lethal(
            cells,
            resolution,
            origin_x,
            origin_y,
            body,
            corners,
            x,
            y,
            heading,
            known,
            count,
            place + 1,
        )
    return known, count


@njit(cache=True, nogil=True)
def sweep(
    cells: np.ndarray, resolution: float, origin_x: float, origin_y: float, body: FloatArray,
    corners: FloatArray, x: float, y: float, heading: float,
    linear: float, lateral: float, angular: float, horizon: float, step: float,
) -> tuple[float, int]:  # fmt: skip
    """Time for which a constant twist can be driven before the footprint covers lethal cells.

    Cells that it covers at the start (late marks, pose errors) do not count, so that the robot can
    always leave them.

    Args:
        cells: (rows, columns) uint8 costs, Nav2's values; off the grid is free.
        resolution: side of a cell, metres.
        origin_x: outer corner of cell (0, 0), map frame, metres.
        origin_y: of the same corner, metres.
        body: (m, 2) points that fill the footprint, base frame, metres; at most 0.7 cells apart,
            because a coarser grid of points can miss a cell.
        corners: (n, 2) polygon, base frame; a lethal cell with its centre inside is a collision.
        x: of the base, map frame, metres.
        y: of the base, map frame, metres.
        heading: of the base, map frame, radians.
        linear: m/s forward.
        lateral: m/s to the left.
        angular: rad/s, positive to the left.
        horizon: seconds to look ahead.
        step: seconds between the checked poses.

    Returns:
        Seconds up to the last pose before the collision (inf: none within the horizon), and the
        highest passable cost under the base up to there.
    """
    rows, columns = cells.shape
    known, count = _covered(cells, resolution, origin_x, origin_y, body, corners, x, y, heading)
    worst = 0
    time = 0.0
    while True:
        row = floor((y - origin_y) / resolution)
        column = floor((x - origin_x) / resolution)
        if 0 <= row < rows and 0 <= column < columns:
            cost = int(cells[row, column])
            if cost <= LETHAL:
                worst = max(worst, min(cost, HIGHEST_PASSABLE))
        if time >= horizon:
            return inf, worst
        span = min(step, horizon - time)
        middle = heading + 0.5 * span * angular
        c, s = cos(middle), sin(middle)
        x += span * linear * c - span * lateral * s
        y += span * linear * s + span * lateral * c
        heading += span * angular
        place, _ = _first_lethal(
            cells, resolution, origin_x, origin_y, body, corners, x, y, heading, known, count, 0
        )
        if place >= 0:
            return time, worst
        time += span
        if horizon - time < 1e-9:
            time = horizon


@njit(cache=True, nogil=True)
def clear_poses(
    cells: np.ndarray, resolution: float, origin_x: float, origin_y: float, body: FloatArray,
    corners: FloatArray, x: float, y: float, heading: float, poses: FloatArray, near: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Count the poses of each motion before the footprint covers lethal cells.

    Cells that it covers now do not count, as in `sweep`.

    Args:
        cells: (rows, columns) uint8 costs, Nav2's values; off the grid is free.
        resolution: side of a cell, metres.
        origin_x: outer corner of cell (0, 0), map frame, metres.
        origin_y: of the same corner, metres.
        body: (m, 2) points that fill the footprint, base frame, metres.
        corners: (n, 2) polygon, base frame; a lethal cell with its centre inside is a collision.
        x: of the base now, map frame, metres.
        y: of the base now, map frame, metres.
        heading: of the base now, map frame, radians.
        poses: (n, k, 3) x, y, heading of k poses on each of n motions, map frame.
        near: (rows, columns) uint8, 0 where no lethal cell is within the footprint's radius.

    Returns:
        (n,) int64 in 0..k.
    """
    rows, columns = cells.shape
    known, count = _covered(cells, resolution, origin_x, origin_y, body, corners, x, y, heading)
    clear = np.full(poses.shape[0], poses.shape[1], np.int64)
    for i in range(poses.shape[0]):
        for j in range(poses.shape[1]):
            row = floor((poses[i, j, 1] - origin_y) / resolution)
            column = floor((poses[i, j, 0] - origin_x) / resolution)
            if 0 <= row < rows and 0 <= column < columns and near[row, column] == 0:
                continue
            place, _ = _first_lethal(
                cells, resolution, origin_x, origin_y, body, corners,
                poses[i, j, 0], poses[i, j, 1], poses[i, j, 2], known, count, 0,
            )  # fmt: skip
            if place >= 0:
                clear[i] = j
                break
    return clear
