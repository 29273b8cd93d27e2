"""A start pose for worlds of other formats, which have none."""

from __future__ import annotations

import numpy as np

from stack.types import OccupancyGrid, Pose2D

CLEARANCE = 0.5
"""Free distance around the start, metres, if the map has such a place."""


def free_place(grid: OccupancyGrid) -> Pose2D:
    """Return the free place nearest to the origin of the map frame that has enough clearance."""
    import cv2

    free = np.pad(grid.free.astype(np.uint8), 1)
    clearance = cv2.distanceTransform(free, cv2.DIST_L2, 5)[1:-1, 1:-1] * grid.resolution
    rows, columns = np.nonzero(clearance >= min(CLEARANCE, float(clearance.max())))
    x = grid.origin[0] + (columns + 0.5) * grid.resolution
    y = grid.origin[1] + (rows + 0.5) * grid.resolution
    nearest = int(np.argmin(np.hypot(x, y)))
    return Pose2D(float(x[nearest]), float(y[nearest]))
