"""Numba kernels of the collision monitor."""

from __future__ import annotations

from math import cos, hypot, inf, sin

from numba import f8, njit

from stack.types import FloatArray


@njit(cache=True, nogil=True)
def signed_distance(corners: FloatArray, x: float, y: float) -> float:
    """Signed distance from a point to a polygon, metres; negative inside.

    Args:
        corners: (n, 2) of a simple polygon, metres; repeated corners are ignored.
        x: of the point, in the frame of the corners.
        y: likewise.
    """
    nearest = inf
    inside = False
    n = corners.shape[0]
    for i in range(n):
        ax, ay = corners[i - 1, 0], corners[i - 1, 1]
        bx, by = corners[i, 0], corners[i, 1]
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        share = ((x - ax) * dx + (y - ay) * dy) / square if square > 0.0 else 0.0
        share = min(1.0, max(0.0, share))
        nearest = min(nearest, hypot(ax + share * dx - x, ay + share * dy - y))
        if (ay > y) != (by > y) and x < ax + (y - ay) * dx / dy:
            inside = not inside
    return -nearest if inside else nearest


@njit(cache=True, nogil=True)
def time_to_contact(
    points: FloatArray, corners: FloatArray, radius: float, padding: float, slack: float,
    linear: float, lateral: float, angular: float, horizon: float,
) -> tuple[float, int]:  # fmt: skip
    """Time until a twist brings a point within `padding` of the footprint.

    A point that is already nearer must not come nearer; moving away is always allowed. Each point
    is followed by conservative advancement (B. Mirtich, "Impulse-based Dynamic Simulation", 1996):
    no point of the footprint moves faster than speed plus turning rate times radius, so the
    clearance divided by that speed is a time without contact.

    Args:
        points: (m, 2) in the base frame, metres, standing still.
        corners: (n, 2) of the footprint in the base frame, metres.
        radius: circumscribed radius of the footprint, metres.
        padding: clearance to keep, metres.
        slack: metres by which a point within the padding may still approach, for sensor noise.
        linear: m/s forward.
        lateral: m/s to the left.
        angular: rad/s to the left.
        horizon: seconds to look ahead.

    Returns:
        Seconds (inf: no contact within the horizon), and the index of the point (-1: none).
    """
    fastest = hypot(linear, lateral) + abs(angular) * radius
    best, found = inf, -1
    if fastest == 0.0:
        return best, found
    smallest = 0.004 / fastest
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        if hypot(x, y) - radius - padding > fastest * min(best, horizon):
            continue
        limit = min(padding, signed_distance(corners, x, y) - slack)
        time = 0.0
        while time < best and time <= horizon:
            half = 0.5 * angular * time
            reach = time if abs(half) < 1e-9 else time * sin(half) / half
            px = x - reach * (linear * cos(half) - lateral * sin(half))
            py = y - reach * (linear * sin(half) + lateral * cos(half))
            c, s = cos(angular * time), sin(angular * time)
            px, py = c * px + s * py, c * py - s * px
            room = hypot(px, py) - radius - limit
            if room <= 0.0:
                room = signed_distance(corners, px, py) - limit
            if room <= 0.0:
                best, found = time, i
                break
            time += max(room / fastest, smallest)
    return best, found


@njit(cache=True, nogil=True)
def nearest(points: FloatArray, corners: FloatArray) -> float:
    """Distance from a polygon (n, 2) to the nearest of points (m, 2), metres; inf for none."""
    best = inf
    for i in range(points.shape[0]):
        best = min(best, signed_distance(corners, points[i, 0], points[i, 1]))
    return best


CONTACT = ((time_to_contact, (f8[:, ::1], f8[:, ::1], *7 * (f8,))),)
"""Entry points, with the types that the collision monitor calls them with; then of zones."""
ZONES = ((nearest, (f8[:, ::1], f8[:, ::1])),)
