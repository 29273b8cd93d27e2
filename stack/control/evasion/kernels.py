"""Numba kernels of evasion: motions of the robot against the predicted motion of discs."""

from __future__ import annotations

from math import ceil, cos, exp, hypot, inf, pi, sin

import numpy as np
from numba import f8, i8

from stack.kernel_cache import njit
from stack.safety.kernels import signed_distance
from stack.types import FloatArray

TURN_COSINE = 0.35
"""Cosine of the angle to the lookahead point, 70 degrees, from which a robot turns in place."""

NEAR_END = 0.7
"""Seconds to the end of a path that a robot which slows down for it keeps."""


@njit(cache=True, nogil=True)
def discs_in_reach(discs: FloatArray, horizon: float, speed: float, radius: float) -> FloatArray:
    """Return the discs (m, 6) that a robot may meet within a horizon.

    Args:
        discs: (k, 6) as for `times_to_obstacles`, base frame.
        horizon: seconds.
        speed: highest of the robot, m/s.
        radius: circumscribed radius of the robot, metres.
    """
    found, count = np.empty_like(discs), 0
    for k in range(discs.shape[0]):
        own = hypot(discs[k, 2], discs[k, 3])
        if hypot(discs[k, 0], discs[k, 1]) <= horizon * (own + speed) + radius + discs[k, 4]:
            found[count] = discs[k]
            count += 1
    return found[:count].copy()


@njit(cache=True, nogil=True)
def points_outside_discs(
    points: FloatArray, discs: FloatArray, reach: float, around: float
) -> FloatArray:
    """Return the points (m, 2) within reach that belong to no disc.

    Args:
        points: (n, 2) base frame, metres.
        discs: (k, 6) as for `times_to_obstacles`.
        reach: metres from the base.
        around: metres round a disc within which points belong to it.
    """
    found, count = np.empty_like(points), 0
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        is_free = hypot(x, y) <= reach
        for k in range(discs.shape[0]):
            is_free = is_free and hypot(x - discs[k, 0], y - discs[k, 1]) > discs[k, 4] + around
        if is_free:
            found[count, 0], found[count, 1] = x, y
            count += 1
    return found[:count].copy()


@njit(cache=True, nogil=True)
def evenly_spaced(path: FloatArray, reach: float, spacing: float) -> FloatArray:
    """Return points (m, 2) at equal distances along the first `reach` metres of a path (n, 2)."""
    last = path.shape[0] - 1
    lengths = np.zeros(last + 1)
    for i in range(last):
        step = hypot(path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1])
        lengths[i + 1] = lengths[i] + step
    count = ceil((min(lengths[last], reach) + 1e-9) / spacing)
    points, before = np.empty((count, 2)), 0
    for i in range(count):
        along = spacing * i
        while before < last and lengths[before + 1] <= along:
            before += 1
        points[i] = path[before]
        if before < last and along > lengths[before]:
            step, share = lengths[before + 1] - lengths[before], along - lengths[before]
            for axis in range(2):
                rise = path[before + 1, axis] - path[before, axis]
                points[i, axis] = rise / step * share + path[before, axis]
    return points


@njit(cache=True, nogil=True)
def times_to_obstacles(
    discs: FloatArray, points: FloatArray, horizon: float, overlap: float, around: float
) -> FloatArray:
    """Seconds for which discs can keep their velocity until they meet points that stand still.

    Args:
        discs: (k, 6) x, y, velocity x, velocity y, radius, and seconds until the disc sets off.
        points: (m, 2) metres, in the same frame.
        horizon: seconds; the longest answer.
        overlap: metres of the radius by which a disc may overlap a point.
        around: metres round a disc within which points belong to it.

    Returns:
        (k,) seconds of walking.
    """
    times = np.full(discs.shape[0], horizon)
    for k in range(discs.shape[0]):
        vx, vy = discs[k, 2], discs[k, 3]
        square = vx * vx + vy * vy
        if square < 1e-6:
            continue
        reach = discs[k, 4] - overlap
        for i in range(points.shape[0]):
            dx, dy = points[i, 0] - discs[k, 0], points[i, 1] - discs[k, 1]
            if hypot(dx, dy) <= discs[k, 4] + around:
                continue
            along = dx * vx + dy * vy
            left = reach * reach * square - (dx * vy - dy * vx) ** 2
            if along > 0.0 and left > 0.0:
                times[k] = min(times[k], max(0.0, (along - left**0.5) / square))
    return times


@njit(cache=True, nogil=True)
def least_gap_ahead(discs: FloatArray, corners: FloatArray, x: float, y: float) -> float:
    """Return the distance to the nearest disc that a robot has not passed, metres; inf: none.

    Args:
        discs: (k, 6) as for `times_to_obstacles`, base frame.
        corners: (c, 2) of the footprint, base frame.
        x: direction in which the robot drives, a unit vector.
        y: likewise.
    """
    least, rear = inf, inf
    for i in range(corners.shape[0]):
        rear = min(rear, x * corners[i, 0] + y * corners[i, 1])
    for k in range(discs.shape[0]):
        if x * discs[k, 0] + y * discs[k, 1] >= rear:
            gap = signed_distance(corners, discs[k, 0], discs[k, 1]) - discs[k, 4]
            least = min(least, gap)
    return least


@njit(cache=True, nogil=True)
def _towards(last: float, wanted: float, rise: float, fall: float, step: float) -> float:
    """Speed after one step on the way from `last` to `wanted`."""
    most = (fall if abs(wanted) < abs(last) or wanted * last < 0.0 else rise) * step
    return last + min(max(wanted - last, -most), most)


@njit(cache=True, nogil=True)
def way_beside(path: FloatArray) -> FloatArray:
    """Add to each point of a path (n, 2) the unit vector to its left: (n, 4)."""
    n = path.shape[0]
    way = np.empty((n, 4))
    for i in range(n):
        before, after = max(i - 1, 0), min(i + 1, n - 1)
        dx, dy = path[after, 0] - path[before, 0], path[after, 1] - path[before, 1]
        length = max(hypot(dx, dy), 1e-9)
        way[i, 0], way[i, 1] = path[i, 0], path[i, 1]
        way[i, 2], way[i, 3] = -dy / length, dx / length
    return way


@njit(cache=True, nogil=True)
def lane_twist(
    way: FloatArray, passed: int, pose: FloatArray, speed: float, offset: float,
    steering: FloatArray,
) -> tuple[float, float, int]:  # fmt: skip
    """Velocity that follows a lane beside a path, by pure pursuit.

    Args:
        way: (m, 4) points of the path and unit vectors to its left, equally spaced.
        passed: number of the point that the robot has passed.
        pose: (3,) x, y, heading, in the frame of the path.
        speed: m/s; negative: the robot drives along the path in reverse.
        offset: of the lane to the left of the path, metres.
        steering: spacing of the points and lookahead distance, metres; largest turning speed,
            rad/s; largest curvature, 1/m; whether the robot turns in place (0 or 1).

    Returns:
        Forward speed, turning speed, and the number of the point that is passed then.
    """
    spacing, lookahead, most, curvature = steering[0], steering[1], steering[2], steering[3]
    last = way.shape[0] - 1
    x, y, heading = pose[0], pose[1], pose[2]
    sign = 1.0
    if speed < 0.0:
        sign, speed, heading = -1.0, -speed, heading + pi
    best = hypot(way[passed, 0] - x, way[passed, 1] - y)
    while passed < last:
        away = hypot(way[passed + 1, 0] - x, way[passed + 1, 1] - y)
        if away > best:
            break
        passed, best = passed + 1, away
    ahead = min(passed + max(1, int(lookahead / spacing + 0.5)), last)
    dx = way[ahead, 0] + offset * way[ahead, 2] - x
    dy = way[ahead, 1] + offset * way[ahead, 3] - y
    away = hypot(dx, dy)
    if away < spacing:
        return 0.0, 0.0, passed
    c, s = cos(heading), sin(heading)
    forward, left = (c * dx + s * dy) / away, (c * dy - s * dx) / away
    if steering[4] > 0.0 and forward < TURN_COSINE:
        return 0.0, most if left > 0.0 else -most, passed
    if forward < 0.0:
        left = 1.0 if left > 0.0 else -1.0
    bend = min(max(2.0 * left / max(away, 0.2), -curvature), curvature)
    speed = min(speed, away / NEAR_END) if ahead == last else speed
    if abs(bend) * speed > most:
        speed = most / abs(bend)
    return sign * speed, bend * speed, passed


@njit(cache=True, nogil=True)
def _later_meeting(
    robot: FloatArray, discs: FloatArray, walking: FloatArray, horizon: float, reach: float
) -> float:
    """Seconds until a robot that drives straight on after the horizon meets a disc; inf: never.

    Costs of this time keep a robot from reversing before a person who walks faster than it does.

    Args:
        robot: (4,) position and velocity at the horizon, base frame now.
        discs: (k, 6) as in `times_to_obstacles`, base frame now.
        walking: (k,) seconds for which each disc walks.
        horizon: seconds. As many seconds later are looked at.
        reach: metres between the robot's centre and the surface of a disc at a meeting.
    """
    later = inf
    for k in range(discs.shape[0]):
        walked = min(max(horizon - discs[k, 5], 0.0), walking[k])
        dx = discs[k, 0] + walked * discs[k, 2] - robot[0]
        dy = discs[k, 1] + walked * discs[k, 3] - robot[1]
        goes_on = 1.0 if walking[k] >= horizon - 1e-9 else 0.0
        vx, vy = goes_on * discs[k, 2] - robot[2], goes_on * discs[k, 3] - robot[3]
        square, closing = vx * vx + vy * vy, -(dx * vx + dy * vy)
        if closing <= 0.0 or hypot(dx, dy) <= reach + discs[k, 4]:
            continue
        left = (reach + discs[k, 4]) ** 2 * square - (dx * vy - dy * vx) ** 2
        if left > 0.0:
            time = (closing - left**0.5) / square
            if time <= horizon:
                later = min(later, horizon + time)
    return later


@njit(cache=True, nogil=True)
def motion_costs(
    lanes: FloatArray, way: FloatArray, steering: FloatArray, motions: FloatArray,
    twist: FloatArray, limits: FloatArray, discs: FloatArray, walking: FloatArray,
    points: FloatArray, corners: FloatArray, radius: float, settings: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Costs of motions among discs, and the time of the first meeting on each.

    A lane is followed beside the path at its speed. A motion accelerates from the current velocity
    to its first twist, holds it for its duration, and goes on with the second one. In front of a
    point that stands still the robot stops and stands. The cost is the sum of the deviation from
    the first candidate, of the time spent close to discs, and of a meeting: the later, the less,
    and more if the robot drives towards the disc.

    Args:
        lanes: (l, 2) speed and offset to the left of the path.
        way: as in `lane_twist`, base frame.
        steering: as in `lane_twist`.
        motions: (n, 7) first twist (forward, left, turn), its seconds, second twist.
        twist: (3,) current velocity.
        limits: (3,) linear acceleration and deceleration, angular acceleration.
        discs: (k, 6) as in `times_to_obstacles`, base frame now.
        walking: (k,) seconds for which each disc walks.
        points: (m, 2) obstacle points, base frame, without those of the discs.
        corners: (c, 2) of the footprint, base frame.
        radius: circumscribed radius of the footprint, metres.
        settings: horizon and step in seconds; padding of a meeting in metres, its growth per
            second, and per m/s of the robot towards the disc; margin of closeness; padding of
            points; decay of the cost in seconds; weights of a meeting, of closeness (per second)
            and of the deviation (per metre); metres per radian of deviation; padding of points for
            motions that are not the wanted one.

    Returns:
        (l + n,) costs, and (l + n,) seconds until the meeting; inf: none. Candidate 0, the first
        lane or without lanes the first motion, is the wanted one.
    """
    horizon, step, padding, growth = settings[0], settings[1], settings[2], settings[3]
    headway, margin, static, decay = settings[4], settings[5], settings[6], settings[7]
    meeting_weight, close_weight, deviation_weight = settings[8], settings[9], settings[10]
    arm, aside = settings[11], settings[12]
    count = int(horizon / step + 0.5)
    compared = min(int(1.0 / step + 0.5), count)
    total = lanes.shape[0] + motions.shape[0]
    costs = np.zeros(total)
    times = np.full(total, inf)
    pose, there = np.zeros(3), np.zeros(4)
    room = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        room[i] = signed_distance(corners, points[i, 0], points[i, 1]) - 0.003
    near = np.empty(discs.shape[0])
    for k in range(discs.shape[0]):
        near[k] = signed_distance(corners, discs[k, 0], discs[k, 1]) - discs[k, 4]
    end_x, end_y, end_turn = 0.0, 0.0, 0.0
    for n in range(total):
        m, passed = n - lanes.shape[0], 0
        keep_off = static if n == 0 or m < 0 else aside
        v, u, w = twist[0], twist[1], twist[2]
        x, y, heading, stands = 0.0, 0.0, 0.0, False
        for s in range(1, count + 1):
            time = s * step
            if not stands:
                if m < 0:
                    pose[0], pose[1], pose[2] = x, y, heading
                    av, aw, passed = lane_twist(
                        way, passed, pose, lanes[n, 0], lanes[n, 1], steering
                    )
                    au = 0.0
                else:
                    first = 0 if time <= motions[m, 3] + 1e-9 else 4
                    av, au = motions[m, first], motions[m, first + 1]
                    aw = motions[m, first + 2]
                v = _towards(v, av, limits[0], limits[1], step)
                u = _towards(u, au, limits[0], limits[1], step)
                w = _towards(w, aw, limits[2], limits[2], step)
                middle = heading + 0.5 * w * step
                c, sn = cos(middle), sin(middle)
                nx, ny = x + step * (c * v - sn * u), y + step * (sn * v + c * u)
                turned = heading + w * step
                c, sn = cos(turned), sin(turned)
                for i in range(points.shape[0]):
                    dx, dy = points[i, 0] - nx, points[i, 1] - ny
                    if dx * dx + dy * dy > (radius + keep_off) ** 2:
                        continue
                    off = signed_distance(corners, c * dx + sn * dy, c * dy - sn * dx)
                    if off < min(keep_off, room[i]):
                        stands = True
                        break
                if stands:
                    v, u, w = 0.0, 0.0, 0.0
                else:
                    x, y, heading = nx, ny, turned
            c, sn = cos(heading), sin(heading)
            fading = exp(-time / decay)
            for k in range(discs.shape[0] if times[n] == inf else 0):
                walked = min(max(time - discs[k, 5], 0.0), walking[k])
                dx = discs[k, 0] + walked * discs[k, 2] - x
                dy = discs[k, 1] + walked * discs[k, 3] - y
                away = hypot(dx, dy)
                if away - radius - discs[k, 4] > margin:
                    continue
                gap = signed_distance(corners, c * dx + sn * dy, c * dy - sn * dx) - discs[k, 4]
                closing = dx * (c * v - sn * u) + dy * (sn * v + c * u)
                closing = max(0.0, closing / max(away, 1e-9))
                keep = padding + growth * time + headway * closing
                if gap < min(keep, near[k] - 0.01):
                    costs[n] += meeting_weight * fading * (1.0 + 2.0 * closing)
                    times[n] = time
                    break
                if gap < margin:
                    costs[n] += close_weight * step * fading * (1.0 - gap / margin) ** 2
            if s == compared:
                if n == 0:
                    end_x, end_y, end_turn = x, y, heading
                off = hypot(x - end_x, y - end_y) + arm * abs(heading - end_turn)
                costs[n] += deviation_weight * off
            if times[n] < inf and s >= compared:
                break
            if times[n] < inf:  # the robot stands where it was met
                stands, v, u, w = True, 0.0, 0.0, 0.0
        if times[n] == inf and m >= 0:
            c, sn = cos(heading), sin(heading)
            there[0], there[1], there[2], there[3] = x, y, c * v - sn * u, sn * v + c * u
            later = _later_meeting(there, discs, walking, horizon, radius + padding)
            costs[n] += meeting_weight * exp(-later / decay)
    return costs, times


_PLANE, _ROW = f8[:, ::1], f8[::1]
EVASION = (
    (discs_in_reach, (_PLANE, *3 * (f8,))),
    (points_outside_discs, (_PLANE, _PLANE, f8, f8)),
    (evenly_spaced, (_PLANE, f8, f8)),
    (times_to_obstacles, (_PLANE, _PLANE, f8, f8, f8)),
    (way_beside, (_PLANE,)),
    (least_gap_ahead, (_PLANE, _PLANE, f8, f8)),
    (lane_twist, (_PLANE, i8, _ROW, f8, f8, _ROW)),
    (
        motion_costs,
        (_PLANE, _PLANE, _ROW, _PLANE, *(_ROW,) * 2, _PLANE, _ROW, *(_PLANE,) * 2, f8, _ROW),
    ),
)
"""Entry points, with the types that `Evasion` calls them with."""
