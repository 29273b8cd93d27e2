"""Compiled loop of the deskewing."""

from __future__ import annotations

from math import atan2, cos, hypot, isnan, pi, sin

import numpy as np
from numba import f8, njit, types
from numpy.typing import NDArray

from stack.types import FloatArray

Vector = tuple[float, float, float]


@njit(cache=True, nogil=True)
def deskewed(
    ranges: FloatArray, angles: FloatArray, stamp: float, increment: float,
    stamps: FloatArray, poses: FloatArray, base: Vector, mount: Vector,
) -> tuple[NDArray[np.float32], FloatArray]:  # fmt: skip
    """Express the end points of beams in the sensor frame at one stamp.

    Args:
        ranges: (n,) metres; +inf: no return; NaN: invalid.
        angles: (n,) beam directions in the sensor frame at each beam's time, radians.
        stamp: of the middle of the scan, seconds.
        increment: seconds from beam to beam.
        stamps: (k,) of the poses, rising, seconds.
        poses: (k, 3) x, y, heading of the base, odom frame; headings without jumps.
        base: x, y, heading of the base at the stamp of the scan, odom frame.
        mount: x, y, heading of the sensor, base frame.

    Returns:
        (n,) ranges, metres, and (n,) beam directions, radians.
    """
    found, bearings = np.empty(ranges.size, np.float32), np.empty(ranges.size)
    base_x, base_y, base_heading = base
    mount_x, mount_y, mount_heading = mount
    base_cosine, base_sine = cos(base_heading), sin(base_heading)
    c, s = cos(base_heading + mount_heading), sin(base_heading + mount_heading)
    last, before, middle = stamps.size - 1, 0, 0.5 * (ranges.size - 1)
    for beam in range(ranges.size):
        time = stamp + increment * (beam - middle)
        while before > 0 and stamps[before] > time:
            before -= 1
        while before < last and stamps[before + 1] <= time:
            before += 1
        x, y, heading = poses[before]
        if before < last and time > stamps[before]:
            step, share = stamps[before + 1] - stamps[before], time - stamps[before]
            x = (poses[before + 1, 0] - x) / step * share + x
            y = (poses[before + 1, 1] - y) / step * share + y
            heading = (poses[before + 1, 2] - heading) / step * share + heading
        heading = (heading + pi) % (2.0 * pi) - pi
        turned = (heading - base_heading + pi) % (2.0 * pi) - pi
        # the sensor's position at the beam's time, from that at the scan's stamp
        forward, aside = cos(heading) - base_cosine, sin(heading) - base_sine
        forth = x - base_x + mount_x * forward - mount_y * aside
        beside = y - base_y + mount_x * aside + mount_y * forward
        ahead, left = c * forth + s * beside, c * beside - s * forth
        # the end point along and across the beam; an infinite range gives no change of bearing
        bearing = angles[beam] + turned
        cosine, sine = cos(bearing), sin(bearing)
        along = ranges[beam] + (cosine * ahead + sine * left)
        across = cosine * left - sine * ahead
        change = atan2(across, along)
        bearings[beam] = bearing if isnan(change) else bearing + change
        found[beam] = hypot(along, across)
    return found, bearings


_VECTOR = types.UniTuple(f8, 3)  # type: ignore[no-untyped-call]
DESKEWING = ((deskewed, (f8[::1], f8[::1], f8, f8, f8[::1], f8[:, ::1], _VECTOR, _VECTOR)),)
"""Entry point, with the types that the deskewing calls it with."""
