"""Numba kernels of evasion: motions of the robot against the predicted motion of discs."""

from __future__ import annotations

from math import cos, exp, hypot, inf, sin

import numpy as np
from numba import f8, njit

from stack.safety.kernels import signed_distance
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def walking_times(
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
def _towards(last: float, wanted: float, rise: float, fall: float, step: float) -> float:
    """Speed after one step on the way from `last` to `wanted`."""
    most = (fall if abs(wanted) < abs(last) or wanted * last < 0.0 else rise) * step
    return last + min(max(wanted - last, -most), most)


@njit(cache=True, nogil=True)
def motion_costs(
    motions: FloatArray, twist: FloatArray, limits: FloatArray, discs: FloatArray,
    walking: FloatArray, points: FloatArray, corners: FloatArray, radius: float,
    settings: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Costs of motions among discs, and the time of the first meeting on each.

    A motion accelerates from the current velocity to its first twist, holds it for its duration,
    and goes on with the second one. In front of a point that stands still it stops and stands. The
    cost is the sum of the deviation from motion 0, of the time spent close to discs, and of a
    meeting: the later, the less, and more if the robot drives towards the disc.

    Args:
        motions: (n, 7) first twist (forward, left, turn), its seconds, second twist; 0: the wanted.
        twist: (3,) current velocity.
        limits: (3,) linear acceleration and deceleration, angular acceleration.
        discs: (k, 6) as in `walking_times`, base frame now.
        walking: (k,) seconds for which each disc walks.
        points: (m, 2) obstacle points, base frame, without those of the discs.
        corners: (c, 2) of the footprint, base frame.
        radius: circumscribed radius of the footprint, metres.
        settings: horizon and step in seconds; padding of a meeting in metres, and its growth per
            second; margin of closeness; padding of points; decay of the cost in seconds; weights of
            a meeting, of closeness (per second) and of the deviation (per metre); metres per radian
            of deviation.

    Returns:
        (n,) costs, and (n,) seconds until the meeting; inf: none.
    """
    horizon, step, padding, growth = settings[0], settings[1], settings[2], settings[3]
    margin, static, decay = settings[4], settings[5], settings[6]
    meeting_weight, close_weight, deviation_weight = settings[7], settings[8], settings[9]
    arm = settings[10]
    count = int(horizon / step + 0.5)
    compared = int(1.0 / step + 0.5)
    costs = np.zeros(motions.shape[0])
    times = np.full(motions.shape[0], inf)
    allowed = np.empty(points.shape[0])
    for i in range(points.shape[0]):
        room = signed_distance(corners, points[i, 0], points[i, 1])
        allowed[i] = min(static, room - 0.003)
    near = np.empty(discs.shape[0])
    for k in range(discs.shape[0]):
        near[k] = signed_distance(corners, discs[k, 0], discs[k, 1]) - discs[k, 4]
    end_x, end_y, end_turn = 0.0, 0.0, 0.0
    for n in range(motions.shape[0]):
        v, u, w = twist[0], twist[1], twist[2]
        x, y, heading, stands = 0.0, 0.0, 0.0, False
        for s in range(1, count + 1):
            time = s * step
            first = 0 if time <= motions[n, 3] + 1e-9 else 4
            if not stands:
                v = _towards(v, motions[n, first], limits[0], limits[1], step)
                u = _towards(u, motions[n, first + 1], limits[0], limits[1], step)
                w = _towards(w, motions[n, first + 2], limits[2], limits[2], step)
                middle = heading + 0.5 * w * step
                c, sn = cos(middle), sin(middle)
                nx, ny = x + step * (c * v - sn * u), y + step * (sn * v + c * u)
                turned = heading + w * step
                c, sn = cos(turned), sin(turned)
                for i in range(points.shape[0]):
                    dx, dy = points[i, 0] - nx, points[i, 1] - ny
                    if dx * dx + dy * dy > (radius + static) ** 2:
                        continue
                    if signed_distance(corners, c * dx + sn * dy, c * dy - sn * dx) < allowed[i]:
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
                if gap < min(padding + growth * time, near[k] - 0.01):
                    closing = max(0.0, (dx * (c * v - sn * u) + dy * (sn * v + c * u)) / away)
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
    return costs, times


_PLANE, _ROW = f8[:, ::1], f8[::1]
EVASION = (
    (walking_times, (_PLANE, _PLANE, f8, f8, f8)),
    (motion_costs, (_PLANE, _ROW, _ROW, _PLANE, _ROW, _PLANE, _PLANE, f8, _ROW)),
)
"""Entry points, with the types that `Evasion` calls them with."""
