"""Scans without what walks: people close no way, they only cost time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from stack.types import FloatArray, Pose2D, Scan, TrackedObject

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
    sensor = pose.compose(scan.mount)
    ranges = np.where(np.isfinite(scan.ranges), scan.ranges, 0.0).astype(np.float64)
    angles = scan.angles + sensor.heading
    x, y = sensor.x + ranges * np.cos(angles), sensor.y + ranges * np.sin(angles)
    places: FloatArray = np.array([item.position for item in objects])
    reach = np.array([item.radius + AROUND for item in objects])
    away = np.hypot(x[:, None] - places[:, 0], y[:, None] - places[:, 1])
    hit = (ranges > 0.0) & (away <= reach).any(axis=1)
    if not hit.any():
        return scan
    masked = scan.ranges.copy()
    masked[hit] = np.nan
    return replace(scan, ranges=masked)
