"""Compiled loops of the particle filter: alignment of a scan, resampling."""

from __future__ import annotations

import numpy as np
from numba import f4, f8, i8, njit
from numpy.typing import NDArray

from stack.localisation.kernels import PLACEMENT, Floats, Placement, add_residuals, solve
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def refine_pose(
    field: Floats, placement: Placement, start: FloatArray, information: FloatArray,
    points: FloatArray, deviation: float,
) -> FloatArray:  # fmt: skip
    """Align points with the map's surfaces by Gauss-Newton, with a prior; see `add_residuals`.

    Args:
        field: signed distance to the nearest surface, metres.
        placement: of the field.
        start: (3,) prior mean.
        information: (3, 3) inverse covariance of the prior, divided by that of a point.
        points: (m, 2) in the base frame.
        deviation: residual in metres whose weight is a quarter.

    Returns:
        (3,) pose.
    """
    pose = start.copy()
    for _ in range(6):
        h = information.copy()
        # Written out: numba's matrix product would need SciPy.
        back = start - pose
        g = information[:, 0] * back[0] + information[:, 1] * back[1] + information[:, 2] * back[2]
        add_residuals(field, placement, pose, points, deviation, h, g)
        step = solve(h, g, 1e-9, 0.0)
        pose += step
        if abs(step[0]) + abs(step[1]) + abs(step[2]) < 1e-5:
            break
    return pose


@njit(cache=True, nogil=True)
def resample(weights: FloatArray, count: int, offset: float) -> NDArray[np.int64]:
    """Low-variance resampling: indices (count,) of the chosen particles.

    S. Thrun, W. Burgard, D. Fox, Probabilistic Robotics, 2005, table 4.4.

    Args:
        weights: (n,), sum 1.
        count: number of particles to draw.
        offset: one uniform draw from [0, 1).
    """
    indices = np.empty(count, dtype=np.int64)
    step = 1.0 / count
    cumulative, i = weights[0], 0
    for k in range(count):
        target = (k + offset) * step
        while cumulative < target and i < weights.shape[0] - 1:
            i += 1
            cumulative += weights[i]
        indices[k] = i
    return indices


FILTER = (
    (refine_pose, (f4[:, ::1], PLACEMENT, f8[::1], f8[:, ::1], f8[:, ::1], f8)),
    (resample, (f8[::1], i8, f8)),
)
"""Entry points, with the types that the filter calls them with."""
