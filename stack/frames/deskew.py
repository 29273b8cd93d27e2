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

from stack.frames.buffer import TransformBuffer
from stack.types import Observation, Scan

MOST_WAITING = 20
"""Scans of a sensor that wait for odometry; of more, the oldest is dropped."""


class Deskewer:
    """Deskews the scans of turning lidars. A scan waits until odometry covers its last beam.

    Attributes:
        dropped: by sensor, the number of scans that were not used: they began before the oldest
            odometry, or a newer one was ready in the same step.
    """

    def __init__(self) -> None:
        self.dropped: dict[str, int] = {}
        self._waiting: dict[str, list[Scan]] = {}

    def update(self, observation: Observation, frames: TransformBuffer) -> Observation:
        """Return the observation with deskewed scans: those for which there is odometry now.

        Also a scan of one instant waits for odometry, or is dropped if it is too old.

        Args:
            observation: the new measurements.
            frames: with the odometry up to the observation's time.
        """
        turning = {
            name: scan for name, scan in observation.of(Scan).items()
            if scan.time_increment or not frames.covers(scan.stamp)
        }  # fmt: skip
        if not turning and not self._waiting:
            return observation
        waiting, self._waiting = self._waiting, {}
        measurements = dict(observation.measurements)
        for name in {**waiting, **turning}:
            scans = [*waiting.get(name, ()), *([turning[name]] if name in turning else ())]
            ready = self._ready(name, scans, frames)
            if ready is not None:
                measurements[name] = ready
            elif name in turning:
                del measurements[name]
        return Observation(observation.time, measurements)

    def _ready(self, name: str, scans: list[Scan], frames: TransformBuffer) -> Scan | None:
        """Return the newest scan that odometry covers, deskewed; keep those that are too new."""
        ready: Scan | None = None
        late: list[Scan] = []
        for scan in scans:
            first, last = scan.interval
            if last > frames.newest and not frames.covers(last):
                late.append(scan)
                continue
            if ready is not None or not frames.covers(first):
                self._drop(name)
            if frames.covers(first):
                ready = scan
        for _ in late[:-MOST_WAITING]:
            self._drop(name)
        if late:
            self._waiting[name] = late[-MOST_WAITING:]
        return None if ready is None else deskew(ready, frames)

    def _drop(self, name: str) -> None:
        self.dropped[name] = self.dropped.get(name, 0) + 1


def deskew(scan: Scan, frames: TransformBuffer) -> Scan:
    """Return the scan with ranges and bearings as seen from the sensor at `scan.stamp`.

    A beam without return keeps its +inf or NaN; its bearing is corrected for the rotation.

    Raises:
        FrameError: odometry does not cover the scan.
    """
    if scan.time_increment == 0.0:
        return scan
    base, mount = frames.pose_at("odom", scan.stamp), scan.mount
    x, y, heading = frames.poses_at(scan.stamps).T
    turned = (heading - base.heading + np.pi) % (2.0 * np.pi) - np.pi
    # the sensor's position at each beam's stamp, from that at the scan's stamp
    forward, aside = np.cos(heading) - cos(base.heading), np.sin(heading) - sin(base.heading)
    forth = x - base.x + mount.x * forward - mount.y * aside
    beside = y - base.y + mount.x * aside + mount.y * forward
    c, s = cos(base.heading + mount.heading), sin(base.heading + mount.heading)
    ahead, left = c * forth + s * beside, c * beside - s * forth
    # the end point along and across the beam; an infinite range gives no change of bearing
    bearings = scan.angles + turned
    cosine, sine = np.cos(bearings), np.sin(bearings)
    along = scan.ranges.astype(np.float64) + (cosine * ahead + sine * left)
    across = cosine * left - sine * ahead
    change = np.arctan2(across, along)
    change[np.isnan(change)] = 0.0
    return replace(
        scan, ranges=np.hypot(along, across).astype(np.float32), bearings=bearings + change,
        time_increment=0.0,
    )  # fmt: skip
