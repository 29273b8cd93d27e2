"""Compiled loops of the particle filter: alignment of a scan, resampling."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numba import f4, f8, i8, njit
from numpy.typing import NDArray

from stack.localisation.kernels import Floats, _distance, _solve
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def refine_pose(
    field: Floats,
    resolution: float,
    origin_x: float,
    origin_y: float,
    start: FloatArray,
    information: FloatArray,
    points: FloatArray,
    deviation: float,
) -> FloatArray:
    """Gauss-Newton on the squared distances of the points to the map's surfaces, with a prior.

    Geman-McClure weights reduce the influence of points far from any surface.

    Args:
        field: signed distance to the nearest surface, metres.
        resolution: metres.
        origin_x: metres.
        origin_y: metres.
        start: (3,) prior mean.
        information: (3, 3) inverse covariance of the prior, divided by that of a point.
        points: (m, 2) in the base frame.
        deviation: residual in metres whose weight is a quarter.

    Returns:
        (3,) pose.
    """
    pose = start.copy()
    scale = 1.0 / resolution
    for _ in range(6):
        h = information.copy()
        # Written out: numba's matrix product would need SciPy.
        back = start - pose
        g = information[:, 0] * back[0] + information[:, 1] * back[1] + information[:, 2] * back[2]
        c, s = cos(pose[2]), sin(pose[2])
        for j in range(points.shape[0]):
            turned_x = c * points[j, 0] - s * points[j, 1]
            turned_y = s * points[j, 0] + c * points[j, 1]
            u = (pose[0] + turned_x - origin_x) * scale
            v = (pose[1] + turned_y - origin_y) * scale
            error = _distance(field, u, v)
            gx = (_distance(field, u + 0.5, v) - _distance(field, u - 0.5, v)) * scale
            gy = (_distance(field, u, v + 0.5) - _distance(field, u, v - 0.5)) * scale
            gh = gy * turned_x - gx * turned_y
            weight = 1.0 / (1.0 + (error / deviation) ** 2) ** 2
            h[0, 0] += weight * gx * gx
            h[0, 1] += weight * gx * gy
            h[0, 2] += weight * gx * gh
            h[1, 1] += weight * gy * gy
            h[1, 2] += weight * gy * gh
            h[2, 2] += weight * gh * gh
            g[0] -= weight * gx * error
            g[1] -= weight * gy * error
            g[2] -= weight * gh * error
        step = _solve(h, g)
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
    (refine_pose, (f4[:, ::1], f8, f8, f8, f8[::1], f8[:, ::1], f8[:, ::1], f8)),
    (resample, (f8[::1], i8, f8)),
)
"""Entry points, with the types that the filter calls them with."""
