"""Ray caster for lidar and sonar: beams against segments and circles in the scan plane."""

from __future__ import annotations

from math import asin, atan2, ceil, cos, floor, hypot, inf, pi, sin, sqrt

import numpy as np
from numba import f8

from stack.kernel_cache import njit

ROUNDING = 1e-9
"""Relative extension of a segment at both ends, so that no beam passes between two segments."""


@njit(cache=True, nogil=True)
def origins_along(times, stamps, poses, x, y, heading, beams):  # type: ignore[no-untyped-def]
    """Compute where a lidar that moves while it turns is at each beam.

    Args:
        times: (n,) of the beams, rising, seconds.
        stamps: (k,) of the poses, rising, seconds.
        poses: (k, 3) x, y, heading of the base, headings without jumps.
        x: of the lidar, base frame, metres.
        y: of the lidar, base frame, metres.
        heading: of the lidar, base frame, radians.
        beams: (n,) directions of the beams, lidar frame, radians.

    Returns:
        (n, 2) origins and (n,) directions of the beams, in the frame of the poses.
    """
    origins, directions = np.empty((times.size, 2)), np.empty(times.size)
    last, before = stamps.size - 1, 0
    for beam in range(times.size):
        while before < last and stamps[before + 1] <= times[beam]:
            before += 1
        base_x, base_y, turn = poses[before]
        if before < last and times[beam] > stamps[before]:
            step, since = stamps[before + 1] - stamps[before], times[beam] - stamps[before]
            base_x = (poses[before + 1, 0] - base_x) / step * since + base_x
            base_y = (poses[before + 1, 1] - base_y) / step * since + base_y
            turn = (poses[before + 1, 2] - turn) / step * since + turn
        c, s = cos(turn), sin(turn)
        origins[beam, 0] = base_x + c * x - s * y
        origins[beam, 1] = base_y + s * x + c * y
        directions[beam] = turn + heading + beams[beam]
    return origins, directions


@njit(cache=True, nogil=True)
def cast(origins, directions, segments, circles):  # type: ignore[no-untyped-def]
    """Compute the distance along each beam of a sensor to the first segment or circle.

    Each obstacle is intersected only with the beams in its interval of bearings: the cost is
    proportional to the obstacles plus the beams they cover, not to their product. The interval is
    taken from the mean origin and widened by the angle that a motion of the origin can make.

    Args:
        origins: (n, 2) x, y of the sensor at each beam, metres, in the frame of the obstacles.
        directions: (n,) increasing beam directions, radians, close to evenly spaced, n > 1;
            together at most a full turn.
        segments: (n, 4) x, y of one end and x, y of the other, metres.
        circles: (m, 3) x, y, radius, metres; the distance from inside is 0.

    Returns:
        (n,) metres; +inf without a hit.
    """
    beams = directions.size
    ranges = np.full(beams, inf)
    units = np.empty((beams, 2))
    x = y = 0.0
    for beam in range(beams):
        units[beam, 0], units[beam, 1] = cos(directions[beam]), sin(directions[beam])
        x += origins[beam, 0] / beams
        y += origins[beam, 1] / beams
    shift = 0.0
    increment = (directions[-1] - directions[0]) / (beams - 1)
    uneven = 0.0
    for beam in range(beams):
        shift = max(shift, hypot(origins[beam, 0] - x, origins[beam, 1] - y))
        uneven = max(uneven, abs(directions[0] + increment * beam - directions[beam]))
    for n in range(segments.shape[0]):
        px, py = segments[n, 0] - x, segments[n, 1] - y
        qx, qy = segments[n, 2] - x, segments[n, 3] - y
        width = atan2(px * qy - py * qx, px * qx + py * qy)
        begin = atan2(py, px) if width >= 0.0 else atan2(qy, qx)
        near = _distance(px, py, qx, qy)
        margin = uneven + (asin(shift / near) if near > shift else pi)
        offset = (begin - margin - directions[0]) % (2.0 * pi)
        for turn in range(-1, 2):
            low, high = _covered(
                offset - 2.0 * pi * turn, abs(width) + 2.0 * margin, increment, beams
            )
            for beam in range(low, high):
                _hit_segment(origins[beam], units[beam], segments[n], ranges, beam)
    for n in range(circles.shape[0]):
        cx, cy, radius = circles[n, 0] - x, circles[n, 1] - y, circles[n, 2]
        distance = hypot(cx, cy)
        if distance <= radius + shift:
            low_angle, half = directions[0], 2.0 * pi
        else:
            half = asin((radius + shift) / distance) + uneven
            low_angle = atan2(cy, cx) - half
        offset = (low_angle - directions[0]) % (2.0 * pi)
        for turn in range(-1, 2):
            low, high = _covered(offset - 2.0 * pi * turn, 2.0 * half, increment, beams)
            for beam in range(low, high):
                _hit_circle(origins[beam], units[beam], circles[n], ranges, beam)
    return ranges


@njit(cache=True, nogil=True)
def cast_rays(origins, units, segments, circles):  # type: ignore[no-untyped-def]
    """Compute the distance along each ray, in any order, to the first segment or circle.

    Every ray is intersected with every obstacle.

    Args:
        origins: (n, 2) x, y of the begin of each ray, metres.
        units: (n, 2) direction of each ray, of length 1.
        segments: as for `cast`.
        circles: as for `cast`.

    Returns:
        (n,) metres; +inf without a hit.
    """
    ranges = np.full(units.shape[0], inf)
    for ray in range(ranges.size):
        for n in range(segments.shape[0]):
            _hit_segment(origins[ray], units[ray], segments[n], ranges, ray)
        for n in range(circles.shape[0]):
            _hit_circle(origins[ray], units[ray], circles[n], ranges, ray)
    return ranges


@njit(cache=True, nogil=True)
def _distance(px, py, qx, qy):  # type: ignore[no-untyped-def]
    """Distance from the origin to the segment from p to q."""
    ex, ey = qx - px, qy - py
    length = ex * ex + ey * ey
    share = 0.0 if length == 0.0 else min(1.0, max(0.0, -(px * ex + py * ey) / length))
    return hypot(px + share * ex, py + share * ey)


@njit(cache=True, nogil=True)
def _hit_segment(origin, unit, segment, ranges, beam):  # type: ignore[no-untyped-def]
    px, py = segment[0] - origin[0], segment[1] - origin[1]
    ex, ey = segment[2] - segment[0], segment[3] - segment[1]
    across = unit[0] * ey - unit[1] * ex
    if across == 0.0:
        return
    along = (px * ey - py * ex) / across
    share = (px * unit[1] - py * unit[0]) / across
    if 0.0 <= along < ranges[beam] and -ROUNDING <= share <= 1.0 + ROUNDING:
        ranges[beam] = along


@njit(cache=True, nogil=True)
def _hit_circle(origin, unit, circle, ranges, beam):  # type: ignore[no-untyped-def]
    cx, cy, radius = circle[0] - origin[0], circle[1] - origin[1], circle[2]
    if hypot(cx, cy) <= radius:
        ranges[beam] = 0.0
        return
    ahead, aside = cx * unit[0] + cy * unit[1], cx * unit[1] - cy * unit[0]
    inside = radius * radius - aside * aside
    if inside < 0.0 or ahead < 0.0:
        return
    along = ahead - sqrt(inside)
    if along < ranges[beam]:
        ranges[beam] = along


@njit(cache=True, nogil=True)
def _covered(offset, width, increment, beams):  # type: ignore[no-untyped-def]
    """Return low, high: beams low to high - 1 are in an interval of bearings, widened by one."""
    low = max(0, ceil(offset / increment) - 1)
    high = min(beams, floor((offset + width) / increment) + 2)
    return low, high


CAST = ((cast, (f8[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1])),)
"""Entry points, with the types that sensors call them with: of lidars and sonars."""
ALONG = ((origins_along, (f8[::1], f8[::1], f8[:, ::1], f8, f8, f8, f8[::1])),)
"""Of lidars that turn while the robot moves."""
CAST_RAYS = ((cast_rays, (f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])),)
"""Of lidars in worlds with mirrors."""
