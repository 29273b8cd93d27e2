"""Numba kernels of the collision monitor."""

from __future__ import annotations

from math import acos, cos, floor, hypot, inf, sin, sqrt

from numba import f8

from stack.kernel_cache import njit
from stack.types import FloatArray

WALKING_SPEED = 0.2
"""m/s from which a disc counts as one that moves."""


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


@njit(cache=True, nogil=True, inline="always")
def _driven(linear: float, lateral: float, angular: float, time: float) -> tuple[float, float]:
    """Displacement by a constant twist after a time, in the frame of the start.

    It is inlined, as a function from numba's cache is not by LLVM.
    """
    half = 0.5 * angular * time
    reach = time if abs(half) < 1e-9 else time * sin(half) / half
    ahead = reach * (linear * cos(half) - lateral * sin(half))
    return ahead, reach * (linear * sin(half) + lateral * cos(half))


@njit(cache=True, nogil=True, inline="always")
def _meeting_time(
    x: float, y: float, vx: float, vy: float, corners: FloatArray, radius: float, limit: float,
    linear: float, lateral: float, angular: float, fastest: float, longest: float,
) -> float:  # fmt: skip
    """Seconds until a moving point is within `limit` of the footprint; inf: not before `longest`.

    Conservative advancement (B. Mirtich, "Impulse-based Dynamic Simulation", 1996): no point of the
    footprint moves faster than speed plus turning rate times radius, so the clearance divided by
    this and the speed of the point, `fastest`, is a time without contact.
    """
    if fastest == 0.0:
        return inf
    smallest = 0.004 / fastest
    time = 0.0
    while time <= longest:
        forward, left = _driven(linear, lateral, angular, time)
        px, py = x + time * vx - forward, y + time * vy - left
        c, s = cos(angular * time), sin(angular * time)
        px, py = c * px + s * py, c * py - s * px
        room = hypot(px, py) - radius - limit
        if room <= 0.0:
            room = signed_distance(corners, px, py) - limit
        if room <= 0.0:
            return time
        time += max(room / fastest, smallest)
    return inf


@njit(cache=True, nogil=True)
def time_to_contact(
    points: FloatArray, corners: FloatArray, radius: float, padding: float, slack: float,
    linear: float, lateral: float, angular: float, horizon: float,
) -> tuple[float, int]:  # fmt: skip
    """Time until a twist brings a point within `padding` of the footprint.

    A point that is already nearer must not come nearer; moving away is always allowed.

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
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        farthest = radius + padding + fastest * min(best, horizon)
        if x * x + y * y > farthest * farthest:
            continue
        limit = padding
        if hypot(x, y) - radius - slack < padding + 1e-6:  # it may be nearer than the padding
            limit = min(padding, signed_distance(corners, x, y) - slack)
        longest = min(best, horizon)
        time = _meeting_time(
            x, y, 0.0, 0.0, corners, radius, limit, linear, lateral, angular, fastest, longest
        )
        if time < best:
            best, found = time, i
    return best, found


@njit(cache=True, nogil=True)
def time_to_meeting(
    discs: FloatArray, corners: FloatArray, radius: float, padding: float, slack: float,
    linear: float, lateral: float, angular: float, horizon: float, moving_padding: float,
) -> tuple[float, int]:  # fmt: skip
    """Time until a twist and the motion of discs bring one within `padding` of the footprint.

    As `time_to_contact`, but the discs move at constant velocities. A disc that would reach a robot
    that stands, and no sooner one with this twist, does not count: the twist leaves its way.

    Args:
        discs: (k, 5) x, y, velocity x, velocity y, radius, base frame now, metres and m/s.
        corners: (n, 2) of the footprint in the base frame, metres.
        radius: circumscribed radius of the footprint, metres.
        padding: clearance to keep, metres.
        slack: metres by which a disc within the padding may still come nearer.
        linear: m/s forward.
        lateral: m/s to the left.
        angular: rad/s to the left.
        horizon: seconds to look ahead.
        moving_padding: clearance to keep to discs that move, metres.

    Returns:
        Seconds (inf: no meeting within the horizon), and the index of the disc (-1: none).
    """
    own = hypot(linear, lateral) + abs(angular) * radius
    best, found = inf, -1
    for i in range(discs.shape[0]):
        x, y, vx, vy, size = discs[i]
        speed = hypot(vx, vy)
        moves = speed >= WALKING_SPEED
        wide = max(padding, moving_padding) if moves else padding
        limit = min(wide, signed_distance(corners, x, y) - size - slack) + size
        longest = min(best, horizon)
        time = _meeting_time(
            x, y, vx, vy, corners, radius, limit, linear, lateral, angular, own + speed, longest
        )
        if time == inf or time >= best:
            continue
        if moves and own > 0.0:
            standing = _meeting_time(
                x, y, vx, vy, corners, radius, limit, 0.0, 0.0, 0.0, speed, time
            )
            if standing <= time:
                continue
        best, found = time, i
    return best, found


@njit(cache=True, nogil=True)
def nearest(points: FloatArray, corners: FloatArray) -> float:
    """Distance from a polygon (n, 2) to the nearest of points (m, 2), metres; inf for none."""
    best = inf
    for i in range(points.shape[0]):
        best = min(best, signed_distance(corners, points[i, 0], points[i, 1]))
    return best


@njit(cache=True, nogil=True)
def in_view(views: FloatArray, x: float, y: float) -> bool:
    """Tell whether a point is in the view of a sensor, ignoring obstacles in front of it.

    Args:
        views: (k, 7) as in `SeenGround.views`.
        x: of the point, base frame, metres.
        y: likewise.
    """
    for k in range(views.shape[0]):
        dx, dy = x - views[k, 0], y - views[k, 1]
        away = hypot(dx, dy)
        if away < views[k, 5] or away > views[k, 6]:
            continue
        ahead = dx * views[k, 2] + dy * views[k, 3]
        if acos(min(1.0, max(-1.0, ahead / away))) <= views[k, 4]:
            return True
    return False


@njit(cache=True, nogil=True)
def share_where_unseen(
    outline: FloatArray, stamps: FloatArray, left: float, bottom: float, cell: float,
    oldest: float, x: float, y: float, heading: float, views: FloatArray,
    linear: float, lateral: float, angular: float,
    reaction: float, braking: float, slowest: float,
) -> float:  # fmt: skip
    """Share of a twist at which the outline enters unseen ground no faster than `slowest`.

    Each point of the outline is followed along the twist. From a share s of the twist, slowing down
    to the share b at which the point moves at `slowest` takes the distance of reaction s + braking
    (s² - b²) seconds at the whole twist. This must not exceed the time after which the point enters
    unseen ground, less the time for the diagonal of a cell. Ground that is in the view of a sensor
    now counts as seen, and so does the cell in which the point is.

    Args:
        outline: (m, 2) points in the base frame, metres.
        stamps: (rows, columns) seconds; a cell with less than `oldest` is unseen.
        left: x of the left edge of the stamps, odom frame, metres.
        bottom: y of their lower edge.
        cell: side of a cell.
        oldest: seconds.
        x: of the base now, odom frame.
        y: likewise.
        heading: likewise, radians.
        views: (k, 7) as in `SeenGround.views`.
        linear: m/s forward.
        lateral: m/s to the left.
        angular: rad/s to the left.
        reaction: seconds before the robot brakes.
        braking: seconds at the whole twist that cover its braking distance.
        slowest: m/s.
    """
    best = 1.0
    ch, sh = cos(heading), sin(heading)
    for i in range(outline.shape[0]):
        ox, oy = outline[i, 0], outline[i, 1]
        speed = hypot(linear - angular * oy, lateral + angular * ox)
        if speed <= slowest * best:
            continue
        bound, time, step = slowest / speed, 0.0, 0.5 * cell / speed
        margin = 3.0 * step
        first_column = floor((x + ch * ox - sh * oy - left) / cell)
        first_row = floor((y + sh * ox + ch * oy - bottom) / cell)
        while True:
            room = max(0.0, time - margin) + braking * bound * bound
            root = sqrt(reaction * reaction + 4.0 * braking * room)
            share = max(bound, 2.0 * room / max(reaction + root, 1e-9))
            if share >= best:
                break
            forward, left_of = _driven(linear, lateral, angular, time)
            c, s = cos(angular * time), sin(angular * time)
            px, py = forward + c * ox - s * oy, left_of + s * ox + c * oy
            column = floor((x + ch * px - sh * py - left) / cell)
            row = floor((y + sh * px + ch * py - bottom) / cell)
            seen = (
                0 <= row < stamps.shape[0]
                and 0 <= column < stamps.shape[1]
                and stamps[row, column] >= oldest
            )
            seen = seen or (row == first_row and column == first_column)
            if not seen and not in_view(views, px, py):
                best = share
                break
            time += step
    return best


CONTACT = (
    (time_to_contact, (f8[:, ::1], f8[:, ::1], *7 * (f8,))),
    (time_to_meeting, (f8[:, ::1], f8[:, ::1], *8 * (f8,))),
)
"""Entry points, with the types that the collision monitor calls them with; then of
the limit in unseen ground, and of zones."""
UNSEEN = ((share_where_unseen, (f8[:, ::1], f8[:, ::1], *7 * (f8,), f8[:, ::1], *6 * (f8,))),)
ZONES = ((nearest, (f8[:, ::1], f8[:, ::1])),)
