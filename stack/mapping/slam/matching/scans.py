"""Scans prepared for matching: points and normals in the base frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.mapping.slam.matching import kernels
from stack.types import FloatArray, Scan

NORMAL_REACH, NORMAL_SPREAD = 0.08, 0.05
"""Neighbours of a point that define its normal: within 8 cm + 5 % of the range."""


@dataclass(frozen=True, slots=True)
class PreparedScan:
    """Points of a scan in the order of its beams, base frame.

    Attributes:
        points: (m, 2) end points, metres.
        normals: (m, 2) unit normals towards the sensor; zero where no surface is seen.
        bearings: (m,) ascending bearings of the points from the sensor, radians.
        sensor: (2,) position of the sensor.
    """

    points: FloatArray
    normals: FloatArray
    bearings: FloatArray
    sensor: FloatArray


def prepare(scan: Scan, longest: float) -> PreparedScan:
    """Return the points of a scan up to a range, with their normals."""
    ranges = scan.ranges
    hit = np.isfinite(ranges) & (ranges <= longest) & (ranges >= scan.range_min)
    if scan.angle_increment < 0.0:  # ascending bearings
        ranges, hit = ranges[::-1], hit[::-1]
    angles = scan.angles if scan.angle_increment >= 0.0 else scan.angles[::-1]
    distances, angles = ranges[hit].astype(np.float64), angles[hit]
    local = np.column_stack([distances * np.cos(angles), distances * np.sin(angles)])
    points = np.ascontiguousarray(scan.mount.transform(local))
    normals = kernels.scan_normals(points, scan.mount.x, scan.mount.y, NORMAL_REACH, NORMAL_SPREAD)
    bearings = angles + scan.mount.heading
    if bearings.size:
        bearings = bearings - 2.0 * np.pi * np.round(bearings.mean() / (2.0 * np.pi))
    sensor = np.array([scan.mount.x, scan.mount.y])
    return PreparedScan(points, normals, np.ascontiguousarray(bearings), sensor)
