"""Scans prepared for matching: points and normals in the base frame."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from stack.mapping.slam.matching import kernels
from stack.types import FloatArray, Scan

NORMAL_REACH, NORMAL_SPREAD = 0.08, 0.05
"""Neighbours of a point that define its normal: within 8 cm + 5 % of the range."""


SURFACE_VARIANCE = 0.03**2 - 0.01**2
"""m²; of a point about the surface of another scan, besides the noise: its normal follows from few
points. 3 cm with a noise of 1 cm."""


@dataclass(frozen=True, slots=True)
class PreparedScan:
    """Points of a scan in the order of its beams, base frame.

    Attributes:
        points: (m, 2) end points, metres.
        normals: (m, 2) unit normals towards the sensor; zero where no surface is seen.
        bearings: (m,) ascending bearings of the points from the sensor, radians.
        sensor: (2,) position of the sensor.
        deviation: of a point from the surface that it is matched with, metres.
    """

    points: FloatArray
    normals: FloatArray
    bearings: FloatArray
    sensor: FloatArray
    deviation: float


def prepare(scan: Scan, longest: float, noise: float) -> PreparedScan:
    """Return the points of a scan up to a range, with their normals.

    Args:
        scan: to match.
        longest: range, metres.
        noise: standard deviation of a range, metres.
    """
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
    return PreparedScan(
        points, normals, np.ascontiguousarray(bearings), sensor, sqrt(noise**2 + SURFACE_VARIANCE)
    )
