"""Scans without what walks: people close no way, they only cost time."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stack.types import Pose2D, Scan, TrackedObject

AROUND = 0.12
"""Metres round a tracked object within which returns belong to it."""


def without_objects(scan: Scan, pose: Pose2D, objects: Sequence[TrackedObject]) -> Scan:
    """Return the scan with invalid ranges (nan) where beams end at objects.

    Args:
        scan: of any lidar.
        pose: of the base when it was taken, map frame.
        objects: at the same time, map frame.
    """
    if not objects:
        return scan
    from stack.perception.tracking.kernels import end_at_discs  # imports numba

    sensor = pose.compose(scan.mount)
    discs = np.array([(*item.position, item.radius + AROUND) for item in objects])
    hit = end_at_discs(
        scan.ranges.astype(np.float64), scan.angles, sensor.x, sensor.y, sensor.heading, discs
    )
    if not hit.any():
        return scan
    masked = scan.ranges.copy()
    masked[hit] = np.nan
    return scan.with_ranges(masked)
