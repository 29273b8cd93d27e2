"""Own body: makes the beams of lidars invalid that see the robot itself.

Those are the beams in the masked directions of robot.yaml, and those that end inside the footprint:
nothing else can be there.
"""

from __future__ import annotations

from math import hypot

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.description import RobotDescription
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.types import Footprint, Observation, Scan

INSIDE = 0.01
"""Metres inside the outline from which a point is the robot's own: the noise of a common lidar, so
that a wall which the robot touches stays."""


class OwnBody:
    """Removes from scans what they show of the robot."""

    def __init__(self, robot: RobotDescription) -> None:
        self._lidars, self._footprint = robot.all_lidars, robot.footprint

    def removed(self, observation: Observation) -> Observation:
        """Return the observation with NaN for the beams that see the robot."""
        scans = observation.of(Scan)
        changed = {name: self._without(name, scan) for name, scan in scans.items()}
        if all(changed[name] is scan for name, scan in scans.items()):
            return observation
        return Observation(observation.time, {**observation.measurements, **changed})

    def _without(self, name: str, scan: Scan) -> Scan:
        own = _ends_inside(scan, self._footprint)
        lidar = self._lidars.get(name)
        if lidar is not None and lidar.mask:
            own |= lidar.masks(scan.angles)
        if not own.any():
            return scan
        ranges = scan.ranges.copy()
        ranges[own] = np.nan
        return scan.with_ranges(ranges)


def _ends_inside(scan: Scan, footprint: Footprint) -> NDArray[np.bool_]:
    """Return (n,) which beams end inside a footprint, by INSIDE at least."""
    reach = footprint.circumscribed_radius + hypot(scan.mount.x, scan.mount.y)
    own: NDArray[np.bool_] = scan.ranges < reach
    if own.any():
        ranges, angles = scan.ranges[own].astype(np.float64), scan.angles[own]
        ends = np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
        points = scan.mount.transform(ends)
        deep = distances_to_edges(points, footprint.points) >= INSIDE
        own[own] = deep & points_inside(points, footprint.points)
    return own
