"""Measurements without what walks: people close no way, they only cost time."""

from __future__ import annotations

from collections.abc import Sequence
from math import asin, atan2, hypot

import numpy as np

from stack.perception.tracking.view import View
from stack.types import TRACK_PADDING, Pose2D, RangeReading, Scan, TrackedObject, wrap_angle


def without_objects(scan: Scan, pose: Pose2D, objects: Sequence[TrackedObject]) -> Scan:
    """Return the scan with invalid ranges (nan) where beams end at objects.

    Args:
        scan: of any lidar.
        pose: of the base when it was taken, map frame.
        objects: at the same time, map frame.
    """
    if not objects:
        return scan
    beams = np.flatnonzero(np.isfinite(scan.ranges) & (scan.ranges > 0.0))
    centres = np.array([item.position for item in objects])
    reach = np.array([item.radius + TRACK_PADDING for item in objects])
    away = View(pose.compose(scan.mount), scan).ends(beams)[:, None] - centres
    hit = beams[(np.hypot(away[..., 0], away[..., 1]) <= reach).any(axis=1)]
    if not hit.size:
        return scan
    masked = scan.ranges.copy()
    masked[hit] = np.nan
    return scan.with_ranges(masked)


def is_echo_of(reading: RangeReading, pose: Pose2D, objects: Sequence[TrackedObject]) -> bool:
    """Return whether an object explains a reading: its surface is in the cone, at that distance.

    Args:
        reading: of a sensor that detects something anywhere in its cone.
        pose: of the base when it was taken, map frame.
        objects: at the same time, map frame.
    """
    sensor = pose.compose(reading.mount)
    for item in objects:
        x, y = item.position
        away = hypot(x - sensor.x, y - sensor.y)
        if abs(away - item.radius - reading.distance) > TRACK_PADDING:
            continue
        off = abs(wrap_angle(atan2(y - sensor.y, x - sensor.x) - sensor.heading))
        half_width = asin(min(1.0, (item.radius + TRACK_PADDING) / max(away, 1e-6)))
        if off <= 0.5 * reading.field_of_view + half_width:
            return True
    return False
