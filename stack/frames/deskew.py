"""Deskewing: corrects a scan for the motion of the robot while the lidar turned.

Each beam is measured from another pose. With the poses at the beams' stamps, the end points are
expressed in the sensor frame at the scan's stamp, so that the scan looks as if all beams were
measured at one instant. The method is common; e.g. J. Zhang and S. Singh, "LOAM: Lidar Odometry and
Mapping in Real-time", RSS 2014, section V.
"""

from __future__ import annotations

from dataclasses import replace

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
    sensor = frames.pose_at("odom", scan.stamp).compose(scan.mount)
    x, y, heading = frames.poses_at("odom", scan.stamps).T
    c, s = np.cos(heading), np.sin(heading)
    origin_x = x + c * scan.mount.x - s * scan.mount.y - sensor.x
    origin_y = y + s * scan.mount.x + c * scan.mount.y - sensor.y
    direction = heading + scan.mount.heading + scan.angles
    returned = np.isfinite(scan.ranges)
    reach = np.where(returned, scan.ranges, 0.0).astype(np.float64)
    dx = np.where(returned, origin_x, 0.0) + np.where(returned, reach, 1.0) * np.cos(direction)
    dy = np.where(returned, origin_y, 0.0) + np.where(returned, reach, 1.0) * np.sin(direction)
    turn = np.arctan2(dy, dx) - sensor.heading - scan.angles
    bearings = scan.angles + (turn + np.pi) % (2.0 * np.pi) - np.pi
    ranges = np.where(returned, np.hypot(dx, dy), scan.ranges).astype(np.float32)
    return replace(scan, ranges=ranges, bearings=bearings, time_increment=0.0)
