"""Scans of lidars that repeat themselves: a hung driver or firmware, which delivers old ranges.

With their new stamps they look like new ones: the robot would drive blind, and the estimate would
stand still with them. A lidar that works measures other ranges in each scan, if only by its noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.perception.sensor_watch import SensorEvent
from stack.types import Observation, Pose2D, Scan, wrap_angle

MOTION = 0.02
"""Motion in which a lidar that works measures something else: metres driven plus radians turned."""


@dataclass
class _Seen:
    scan: Scan
    since: Pose2D
    is_frozen: bool = False


class FrozenScans:
    """Removes scans that are equal, beam by beam, to the one before although the robot has moved.

    A lidar whose description has no noise may repeat its scans, and so may one that sees nothing.

    Args:
        robot: with its lidars.
    """

    def __init__(self, robot: RobotDescription) -> None:
        lidars = robot.real_lidars.items()
        self._noisy = {name for name, lidar in lidars if lidar.noise > 0.0}
        self._seen: dict[str, _Seen] = {}

    def removed(
        self, observation: Observation, odometry: Pose2D
    ) -> tuple[Observation, list[SensorEvent]]:
        """Return the observation without frozen scans, and which lidar freezes or works again.

        Args:
            observation: new measurements.
            odometry: pose in the odom frame.
        """
        events, frozen = [], set()
        for name in self._noisy & observation.measurements.keys():
            scan = observation.measurements[name]
            seen = self._seen.get(name)
            if not isinstance(scan, Scan):
                continue
            if seen is None or not _repeats(scan, seen.scan):
                if seen is not None and seen.is_frozen:
                    text = f"the scans of the sensor {name} change again"
                    events.append(SensorEvent(name, "", text))
                self._seen[name] = _Seen(scan, odometry)
                continue
            turned = abs(wrap_angle(odometry.heading - seen.since.heading))
            if not seen.is_frozen and seen.since.distance_to(odometry) + turned > MOTION:
                seen.is_frozen = True
                text = f"the sensor {name} repeats one scan while the robot moves: not used"
                events.append(SensorEvent(name, "frozen", text))
            if seen.is_frozen:
                frozen.add(name)
        if not frozen:
            return observation, events
        kept = {name: one for name, one in observation.measurements.items() if name not in frozen}
        return Observation(observation.time, kept), events


def _repeats(scan: Scan, before: Scan) -> bool:
    """Return whether a scan sees something, and exactly the same as the one before."""
    one, other = scan.ranges, before.ranges
    same = one.shape == other.shape and one.tobytes() == other.tobytes()
    return same and bool(np.isfinite(one).any())
