"""Scans prepared for matching: points and normals in the base frame."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.mapping.slam.matching import kernels
from stack.types import FloatArray, Pose2D, Scan

NORMAL_REACH, NORMAL_SPREAD = 0.08, 0.05
"""Neighbours of a point that define its normal: within 8 cm + 5 % of the range."""


@dataclass(frozen=True, slots=True)
class PreparedScan:
    """Points of a scan in the order of its beams, base frame.

    Attributes:
        points: (m, 2) end points, metres.
        normals: (m, 2) unit normals towards the sensor; zero where no surface is seen.
    """

    points: FloatArray
    normals: FloatArray


def prepare(scan: Scan, longest: float) -> PreparedScan:
    """Return the points of a scan up to a range, with their normals."""
    ranges = scan.ranges
    hit = np.isfinite(ranges) & (ranges <= longest) & (ranges >= scan.range_min)
    distances, angles = ranges[hit].astype(np.float64), scan.angles[hit]
    local = np.column_stack([distances * np.cos(angles), distances * np.sin(angles)])
    points = np.ascontiguousarray(scan.mount.transform(local))
    normals = kernels.scan_normals(points, scan.mount.x, scan.mount.y, NORMAL_REACH, NORMAL_SPREAD)
    return PreparedScan(points, normals)


def as_row(pose: Pose2D) -> FloatArray:
    """Return (3,) x, y, heading."""
    return np.array([pose.x, pose.y, pose.heading])


def as_pose(row: FloatArray) -> Pose2D:
    """Return the pose of (3,) x, y, heading; the heading is wrapped."""
    return Pose2D(0.0, 0.0).compose(Pose2D(float(row[0]), float(row[1]), float(row[2])))
