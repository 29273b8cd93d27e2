"""Deskewing: corrects a scan for the motion of the robot while the lidar turned.

Each beam is measured from another pose. With the poses at the beams' stamps, the end points are
expressed in the sensor frame at the scan's stamp, so that the scan looks as if all beams were
measured at one instant. The method is common; e.g. J. Zhang and S. Singh, "LOAM: Lidar Odometry and
Mapping in Real-time", RSS 2014, section V.
"""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin

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
    base = frames.pose_at("odom", scan.stamp)
    x, y, heading = frames.poses_at("odom", scan.stamps).T
    mount, angles = scan.mount, scan.angles
    turned = (heading - base.heading + np.pi) % (2.0 * np.pi) - np.pi
    # the sensor's position at each beam's stamp, from that at the scan's stamp
    forward, aside = np.cos(heading) - cos(base.heading), np.sin(heading) - sin(base.heading)
    ahead = x - base.x + mount.x * forward - mount.y * aside
    left = y - base.y + mount.x * aside + mount.y * forward
    c, s = cos(base.heading + mount.heading), sin(base.heading + mount.heading)
    ahead, left = c * ahead + s * left, c * left - s * ahead
    # the end point along and across the beam; an infinite range gives no change of bearing
    bearings = angles + turned
    cosine, sine = np.cos(bearings), np.sin(bearings)
    along = scan.ranges + (cosine * ahead + sine * left)
    across = cosine * left - sine * ahead
    change = np.arctan2(across, along)
    change[np.isnan(change)] = 0.0
    ranges = np.hypot(along, across).astype(np.float32)
    return replace(scan, ranges=ranges, bearings=bearings + change, time_increment=0.0)
