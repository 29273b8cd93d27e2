"""Compiled loops of the escape search: known ground and clearance along a motion."""

from __future__ import annotations

from math import atan2, cos, hypot, inf, isnan, pi, sin

from numba import f8

from stack.kernel_cache import njit
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def _sees(view: FloatArray, ranges: FloatArray, x: float, y: float) -> bool:
    """Whether the beams on both sides of a point reach at least as far as the point."""
    dx, dy, increment = x - view[0], y - view[1], view[4]
    n = int(view[5])
    turn = (atan2(dy, dx) - view[2] - view[3]) % (2.0 * pi)
    beam = turn / increment
    first = int(beam)
    second = first + 1
    if n * increment > 2.0 * pi - 1.5 * increment:  # the beams cover 360 degrees
        first, second = first % n, second % n
    elif second >= n:
        return False
    reach = min(ranges[first], ranges[second])
    if isnan(ranges[first]) or isnan(ranges[second]):
        return False
    return bool(hypot(dx, dy) <= reach)


@njit(cache=True, nogil=True)
def _inside(corners: FloatArray, x: float, y: float) -> bool:
    """Whether a point is inside a polygon."""
    found = False
    for i in range(corners.shape[0]):
        ax, ay = corners[i - 1, 0], corners[i - 1, 1]
        bx, by = corners[i, 0], corners[i, 1]
        if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
            found = not found
    return found


@njit(cache=True, nogil=True)
def _driven_through(trail: FloatArray, corners: FloatArray, x: float, y: float) -> bool:
    """Whether the robot's footprint has covered a point."""
    for i in range(trail.shape[0] - 1, -1, -1):
        dx, dy = x - trail[i, 0], y - trail[i, 1]
        c, s = cos(trail[i, 2]), sin(trail[i, 2])
        if _inside(corners, c * dx + s * dy, c * dy - s * dx):
            return True
    return False


@njit(cache=True, nogil=True)
def known_until(
    poses: FloatArray, outline: FloatArray, views: FloatArray, ranges: FloatArray,
    trail: FloatArray, corners: FloatArray,
) -> int:  # fmt: skip
    """Index of the first pose whose outline leaves the known ground; len(poses) for none.

    Ground is known where a beam passed over it, or where the robot has been.

    Args:
        poses: (k, 3) x, y, heading of the motion, odom frame.
        outline: (m, 2) points along the footprint's edge, base frame, metres.
        views: (v, 6), newest last: x, y, heading of the sensor, odom frame; direction of beam 0 in
            the sensor frame and angle between two beams, radians; number of beams.
        ranges: (v, n) length of free ground along each beam, metres; NaN: invalid beam.
        trail: (t, 3) past poses of the robot, odom frame, newest last.
        corners: (c, 2) of the slightly enlarged footprint, base frame, metres.
    """
    for i in range(poses.shape[0]):
        c, s = cos(poses[i, 2]), sin(poses[i, 2])
        for j in range(outline.shape[0]):
            x = poses[i, 0] + c * outline[j, 0] - s * outline[j, 1]
            y = poses[i, 1] + s * outline[j, 0] + c * outline[j, 1]
            seen = False
            for v in range(views.shape[0] - 1, -1, -1):
                if _sees(views[v], ranges[v], x, y):
                    seen = True
                    break
            if not seen and not _driven_through(trail, corners, x, y):
                return i
    return int(poses.shape[0])


@njit(cache=True, nogil=True)
def _signed_distance(corners: FloatArray, x: float, y: float) -> float:
    """Distance of a point to a polygon, metres; negative inside."""
    nearest = inf
    for i in range(corners.shape[0]):
        ax, ay = corners[i - 1, 0], corners[i - 1, 1]
        dx, dy = corners[i, 0] - ax, corners[i, 1] - ay
        share = ((x - ax) * dx + (y - ay) * dy) / (dx * dx + dy * dy)
        share = min(1.0, max(0.0, share))
        nearest = min(nearest, hypot(ax + share * dx - x, ay + share * dy - y))
    return -nearest if _inside(corners, x, y) else nearest


@njit(cache=True, nogil=True)
def clearances(
    poses: FloatArray, points: FloatArray, corners: FloatArray, radius: float, reach: float,
    floor: float, out: FloatArray,
) -> int:  # fmt: skip
    """Distance from the footprint at each pose to the nearest point, at most `reach`.

    Returns the number of poses before the first one with less clearance than the floor.

    Args:
        poses: (k, 3) x, y, heading.
        points: (m, 2) metres, in the frame of the poses.
        corners: (c, 2) of the footprint, base frame, metres.
        radius: circumscribed radius of the footprint, metres.
        reach: upper limit of the distance, metres.
        floor: the first pose with less clearance than this ends the loop, metres.
        out: (k,), written: metres, negative when a point is inside.
    """
    for i in range(poses.shape[0]):
        c, s = cos(poses[i, 2]), sin(poses[i, 2])
        best = reach
        for j in range(points.shape[0]):
            dx, dy = points[j, 0] - poses[i, 0], points[j, 1] - poses[i, 1]
            if hypot(dx, dy) - radius < best:
                best = min(best, _signed_distance(corners, c * dx + s * dy, c * dy - s * dx))
        if best < floor:
            return i
        out[i] = best
    return int(poses.shape[0])


ESCAPE = (
    (clearances, (f8[:, ::1], f8[:, ::1], f8[:, ::1], f8, f8, f8, f8[::1])),
    (known_until, (f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1], f8[:, ::1])),
)
"""Entry points, with the types that the search calls them with."""
