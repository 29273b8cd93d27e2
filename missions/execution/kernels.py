"""Numba kernels of the measures of a drive among people."""

from __future__ import annotations

from math import cos, hypot, sin

import numpy as np
from numba import f8

from stack.kernel_cache import njit
from stack.safety.kernels import signed_distance
from stack.types import FloatArray


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
            gaps[i] = signed_distance(corners, c * dx + s * dy, c * dy - s * dx) - discs[i, 2]
    return gaps


GAPS = ((disc_gaps, (f8[:, ::1], f8[:, ::1], *5 * (f8,))),)
"""Entry point, with the types that the measures call it with."""
