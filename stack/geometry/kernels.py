"""Compiled loops over polylines: projection and lookahead point."""

from __future__ import annotations

from math import atan2, hypot, inf, sqrt

import numpy as np
from numba import f8, i8

from stack.kernel_cache import njit
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def project(
    points: FloatArray, lengths: FloatArray, x: float, y: float, first: int, until: float
) -> tuple[int, float, float]:
    """Project a point onto a polyline, from vertex `first` up to a length along it.

    Args:
        points: (n, 2) vertices, metres, n >= 2.
        lengths: (n,) length of the polyline up to each vertex, metres.
        x: of the point to project, in the frame of the polyline, metres.
        y: of the same point, metres.
        first: vertex to begin at.
        until: length to search, metres; not below that of the first vertex.

    Returns:
        First vertex of the nearest segment, length up to the projection, distance to it (m).
    """
    best, best_segment, best_length = inf, first, lengths[first]
    for i in range(first, points.shape[0] - 1):
        if lengths[i] > until:
            break
        dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        square = dx * dx + dy * dy
        share = 0.0
        if square > 0.0:
            share = ((x - points[i, 0]) * dx + (y - points[i, 1]) * dy) / square
            share = min(1.0, max(0.0, share))
            if lengths[i] + share * sqrt(square) > until:
                share = (until - lengths[i]) / sqrt(square)
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
def point_at(points: FloatArray, lengths: FloatArray, length: float) -> tuple[float, float]:
    """Point of a polyline at a length along it; its first or last vertex beyond them.

    Args:
        points: (n, 2) vertices, metres.
        lengths: (n,) length of the polyline up to each vertex, metres.
        length: metres.
    """
    after = np.searchsorted(lengths, length, side="right")
    if after == 0:
        return points[0, 0], points[0, 1]
    if after == points.shape[0]:
        return points[-1, 0], points[-1, 1]
    begin = lengths[after - 1]
    share = (length - begin) / (lengths[after] - begin)
    ax, ay = points[after - 1, 0], points[after - 1, 1]
    return ax + share * (points[after, 0] - ax), ay + share * (points[after, 1] - ay)


@njit(cache=True, nogil=True)
def feet(
    points: FloatArray, lengths: FloatArray, positions: FloatArray, first: int, until: float,
    span: float,
) -> FloatArray:  # fmt: skip
    """Project positions onto a polyline, as `project`.

    Args:
        points: (n, 2) vertices, metres, n >= 2.
        lengths: (n,) length of the polyline up to each vertex, metres.
        positions: (k, 2) to project, in the frame of the polyline, metres.
        first: vertex to begin at.
        until: length to search, metres; not below that of the first vertex.
        span: metres before and after a foot over which the heading is measured.

    Returns:
        (k, 3) length up to each foot and distance to it, metres, and heading of the polyline there.
    """
    found = np.empty((positions.shape[0], 3))
    for i in range(positions.shape[0]):
        _, length, offset = project(points, lengths, positions[i, 0], positions[i, 1], first, until)
        bx, by = point_at(points, lengths, length - span)
        cx, cy = point_at(points, lengths, length + span)
        found[i, 0], found[i, 1], found[i, 2] = length, offset, atan2(cy - by, cx - bx)
    return found


PATHS = (
    (feet, (f8[:, ::1], f8[::1], f8[:, ::1], i8, f8, f8)),
    (project, (f8[:, ::1], f8[::1], f8, f8, i8, f8)),
    (length_at_distance, (f8[:, ::1], f8[::1], f8, f8, f8, f8)),
)
"""Entry points, with the types that `PathSegment` calls them with."""
