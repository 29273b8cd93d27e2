"""Numba kernels of the measures of a drive among people.

The distance to a polygon is duplicated from stack/safety/kernels.py: numba's cache does not notice
changes in a function of another module.
"""

from __future__ import annotations

from math import cos, hypot, inf, sin

import numpy as np
from numba import f8, njit

from stack.types import FloatArray


@njit(cache=True, nogil=True)
def _signed_distance(corners: FloatArray, x: float, y: float) -> float:
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
def disc_gaps(
    discs: FloatArray, corners: FloatArray, radius: float, near: float,
    x: float, y: float, heading: float,
) -> FloatArray:  # fmt: skip
    """Distances between a footprint and discs, metres; negative where they overlap.

    Args:
        discs: (n, 3) x, y, radius, metres; nan: not there.
        corners: (m, 2) of the footprint in the base frame, metres.
        radius: of the circle that stands for the footprint farther away than `near`, metres.
        near: metres.
        x: of the base, in the frame of the discs, metres.
        y: likewise.
        heading: likewise, radians.

    Returns:
        (n,) metres; nan: not there.
    """
    gaps, c, s = np.empty(discs.shape[0]), cos(heading), sin(heading)
    for i in range(discs.shape[0]):
        dx, dy = discs[i, 0] - x, discs[i, 1] - y
        gaps[i] = hypot(dx, dy) - discs[i, 2] - radius
        if gaps[i] < near:
            gaps[i] = _signed_distance(corners, c * dx + s * dy, c * dy - s * dx) - discs[i, 2]
    return gaps


GAPS = ((disc_gaps, (f8[:, ::1], f8[:, ::1], *5 * (f8,))),)
"""Entry point, with the types that the measures call it with."""
