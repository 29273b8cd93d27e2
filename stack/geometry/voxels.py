"""Numbers of the cells of a grid in space."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray


def voxel_keys(points: FloatArray, side: float) -> NDArray[np.int64]:
    """Return (n,) one number per voxel of points (n, 3 or more); within 50 km of the origin."""
    cells = np.floor(points[:, :3] * (1.0 / side)).astype(np.int64) + (1 << 20)
    keys: NDArray[np.int64] = (cells[:, 0] << 42) | (cells[:, 1] << 21) | cells[:, 2]
    return keys
