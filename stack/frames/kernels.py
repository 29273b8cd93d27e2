"""Numba kernel of forward kinematics along a chain of joints."""

from __future__ import annotations

from math import cos, sin

import numpy as np
from numba import b1, f8

from stack.kernel_cache import njit
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def chain_pose(
    placed: FloatArray, axes: FloatArray, turns: FloatArray, positions: FloatArray,
    last: FloatArray,
) -> FloatArray:  # fmt: skip
    """Transform (4, 4) from above the first joint of a chain to below its last.

    Args:
        placed: (n, 4, 4) each joint at 0 in the frame of the one before, metres.
        axes: (n, 3) unit vectors in the frames of the joints.
        turns: (n,) whether a joint turns about its axis; otherwise it slides along it.
        positions: (n,) radians or metres.
        last: (4, 4) behind the last joint.
    """
    found, step, own = np.eye(4), np.eye(4), np.eye(4)
    for joint in range(len(positions) + 1):
        _multiply(found, placed[joint] if joint < len(positions) else last, step)
        if joint == len(positions):
            break
        x, y, z = axes[joint]
        q = positions[joint]
        if turns[joint]:  # Rodrigues' formula
            c, s = cos(q), sin(q)
            v = 1.0 - c
            own[0, 0], own[0, 1], own[0, 2] = c + v * x * x, v * x * y - s * z, v * x * z + s * y
            own[1, 0], own[1, 1], own[1, 2] = v * x * y + s * z, c + v * y * y, v * y * z - s * x
            own[2, 0], own[2, 1], own[2, 2] = v * x * z - s * y, v * y * z + s * x, c + v * z * z
            own[:3, 3] = 0.0
        else:
            own[:, :] = 0.0
            own[0, 0] = own[1, 1] = own[2, 2] = own[3, 3] = 1.0
            own[0, 3], own[1, 3], own[2, 3] = q * x, q * y, q * z
        _multiply(step, own, found)
    return step


@njit(cache=True, nogil=True)
def _multiply(left: FloatArray, right: FloatArray, product: FloatArray) -> None:
    """Product of two rigid transforms (4, 4), into the rows of a third."""
    for i in range(3):
        for j in range(4):
            total = left[i, 3] if j == 3 else 0.0
            for k in range(3):
                total += left[i, k] * right[k, j]
            product[i, j] = total


CHAIN = ((chain_pose, (f8[:, :, ::1], f8[:, ::1], b1[::1], f8[::1], f8[:, ::1])),)
"""Entry point, with the types that `LinkChain` calls it with."""
