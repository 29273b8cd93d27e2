"""Transforms (4, 4) from positions with Euler angles or quaternions."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin

import numpy as np

from stack.types import FloatArray


def from_angles(position: Sequence[float] | FloatArray, angles: Sequence[float]) -> FloatArray:
    """Return the transform of a position, metres, and roll, pitch and yaw, radians.

    The angles are about the fixed x, y and z axes, in this order, as in URDF and SDF.
    """
    matrix = np.eye(4)
    matrix[:3, 3] = position
    if any(angles):
        (cr, cp, cy), (sr, sp, sy) = (map(f, angles) for f in (cos, sin))
        matrix[:3, :3] = [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    return matrix


def from_quaternion(
    position: Sequence[float] | FloatArray, quaternion: Sequence[float]
) -> FloatArray:
    """Return the transform of a position, metres, and a quaternion x, y, z, w of any norm.

    One of norm 0 does not turn.
    """
    x, y, z, w = quaternion
    square = x * x + y * y + z * z + w * w
    s = 2.0 / square if square > 1e-18 else 0.0
    xs, ys, zs = x * s, y * s, z * s
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1.0 - (y * ys + z * zs), x * ys - w * zs, x * zs + w * ys],
        [x * ys + w * zs, 1.0 - (x * xs + z * zs), y * zs - w * xs],
        [x * zs - w * ys, y * zs + w * xs, 1.0 - (x * xs + y * ys)],
    ]
    matrix[:3, 3] = position
    return matrix
