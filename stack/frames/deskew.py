"""Deskewing: corrects a scan for the motion of the robot while the lidar turned.

Each beam is measured from another pose. With the poses at the beams' stamps, the end points are
expressed in the sensor frame at the scan's stamp, so that the scan looks as if all beams were
measured at one instant. The method is common; e.g. J. Zhang and S. Singh, "LOAM: Lidar Odometry and
Mapping in Real-time", RSS 2014, section V.
"""

from __future__ import annotations

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

        Args:
            observation: the new measurements.
            frames: with the odometry up to the observation's time.
        """
        turning = {n: scan for n, scan in observation.of(Scan).items() if scan.time_increment}
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
    from stack.frames.kernels import deskewed  # imports numba

    base, mount = frames.pose_at("odom", scan.stamp), scan.mount
    ranges, bearings = deskewed(
        scan.ranges.astype(np.float64), scan.angles, scan.stamp, scan.time_increment,
        *frames.odometry_between(*scan.interval),
        (base.x, base.y, base.heading), (mount.x, mount.y, mount.heading),
    )  # fmt: skip
    return Scan(
        scan.stamp, ranges, scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max,
        mount, time_increment=0.0, bearings=bearings,
    )  # fmt: skip
