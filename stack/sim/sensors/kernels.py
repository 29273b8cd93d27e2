"""The lidar's ray caster, compiled: analytic against segments and circles in the scan plane."""

from __future__ import annotations

from math import asin, atan2, ceil, cos, floor, hypot, inf, pi, sin, sqrt

import numpy as np
from numba import njit

ROUNDING = 1e-9
"""Share of a segment by which it is longer than it is, so that no beam slips through a corner."""


@njit(cache=True, nogil=True)
def cast(x, y, first, increment, beams, segments, circles):  # type: ignore[no-untyped-def]
    """Distance along each beam to the first segment or circle.

    Each thing is tried on the beams that its bearing covers only, so the cost grows with the
    things plus the beams they cover and not with their product.

    Args:
        x: of the sensor, metres.
        y: likewise.
        first: direction of beam 0, radians, in the frame of the things.
        increment: radians from beam to beam.
        beams: their number; together they cover a full turn at most.
        segments: (n, 4) x, y of one end, x, y of the other.
        circles: (m, 3) x, y, radius; from inside the distance is 0.

    Returns:
        (beams,) metres, +inf where there is nothing.
    """
    ranges = np.full(beams, inf)
    directions = np.empty((beams, 2))
    for beam in range(beams):
        angle = first + increment * beam
        directions[beam, 0], directions[beam, 1] = cos(angle), sin(angle)
    for n in range(segments.shape[0]):
        _cast_on_segment(x, y, first, increment, directions, segments[n], ranges)
    for n in range(circles.shape[0]):
        _cast_on_circle(x, y, first, increment, directions, circles[n], ranges)
    return ranges


@njit(cache=True, nogil=True)
def _cast_on_segment(x, y, first, increment, directions, segment, ranges):  # type: ignore[no-untyped-def]
    px, py = segment[0] - x, segment[1] - y
    qx, qy = segment[2] - x, segment[3] - y
    ex, ey = qx - px, qy - py
    width = atan2(px * qy - py * qx, px * qx + py * qy)
    begin = atan2(py, px) if width >= 0.0 else atan2(qy, qx)
    offset = (begin - first) % (2.0 * pi)
    for turn in range(2):
        low, high = _covered(offset - 2.0 * pi * turn, abs(width), increment, ranges.size)
        for beam in range(low, high):
            dx, dy = directions[beam]
            across = dx * ey - dy * ex
            if across == 0.0:
                continue
            along = (px * ey - py * ex) / across
            share = (px * dy - py * dx) / across
            if 0.0 <= along < ranges[beam] and -ROUNDING <= share <= 1.0 + ROUNDING:
                ranges[beam] = along


@njit(cache=True, nogil=True)
def _cast_on_circle(x, y, first, increment, directions, circle, ranges):  # type: ignore[no-untyped-def]
    cx, cy, radius = circle[0] - x, circle[1] - y, circle[2]
    distance = hypot(cx, cy)
    if distance <= radius:
        ranges[:] = 0.0
        return
    half = asin(radius / distance)
    offset = (atan2(cy, cx) - half - first) % (2.0 * pi)
    for turn in range(2):
        low, high = _covered(offset - 2.0 * pi * turn, 2.0 * half, increment, ranges.size)
        for beam in range(low, high):
            dx, dy = directions[beam]
            ahead, aside = cx * dx + cy * dy, cx * dy - cy * dx
            inside = radius * radius - aside * aside
            if inside < 0.0 or ahead < 0.0:
                continue
            along = ahead - sqrt(inside)
            if along < ranges[beam]:
                ranges[beam] = along


@njit(cache=True, nogil=True)
def _covered(offset, width, increment, beams):  # type: ignore[no-untyped-def]
    """Beams low to high - 1 within an interval of bearings, one more on either side."""
    low = max(0, ceil(offset / increment) - 1)
    high = min(beams, floor((offset + width) / increment) + 2)
    return low, high
