"""Deskewing: corrects a scan for the motion of the robot while the lidar turned.

Each beam is measured from another pose. With the poses at the beams' stamps, the end points are
expressed in the sensor frame at the scan's stamp, so that the scan looks as if all beams were
measured at one instant. The method is common; e.g. J. Zhang and S. Singh, "LOAM: Lidar Odometry and
Mapping in Real-time", RSS 2014, section V.
"""

from __future__ import annotations

import numpy as np

from stack.errors import FrameError
from stack.frames.buffer import TransformBuffer
from stack.types import Observation, Scan


def deskew_observation(observation: Observation, frames: TransformBuffer) -> Observation:
    """Return the observation with its scans deskewed.

    A scan that began before the first odometry is dropped: its motion is not known.
    """
    scans = observation.of(Scan)
    if not any(scan.time_increment for scan in scans.values()):
        return observation
    measurements = dict(observation.measurements)
    for name, scan in scans.items():
        try:
            measurements[name] = deskew(scan, frames)
        except FrameError:
            del measurements[name]
    return Observation(observation.time, measurements)


def deskew(scan: Scan, frames: TransformBuffer) -> Scan:
    """Return the scan with ranges and bearings as seen from the sensor at `scan.stamp`.

    A beam without return keeps its +inf or NaN; its bearing is corrected for the rotation.

    Raises:
        FrameError: odometry does not cover the scan.
    """
    if scan.time_increment == 0.0:
        return scan
    from stack.frames.kernels import deskewed  # imports numba

    base, mount = frames.pose_at("odom", scan.stamp), scan.mount
    half = abs(scan.time_increment) * 0.5 * (scan.ranges.size - 1)
    ranges, bearings = deskewed(
        scan.ranges.astype(np.float64), scan.angles, scan.stamp, scan.time_increment,
        *frames.odometry_between(scan.stamp - half, scan.stamp + half),
        (base.x, base.y, base.heading), (mount.x, mount.y, mount.heading),
    )  # fmt: skip
    return Scan(
        scan.stamp, ranges, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max,
        mount, time_increment=0.0, bearings=bearings,
    )  # fmt: skip
