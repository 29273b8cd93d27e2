"""A scan where it was taken: its returns, and which ground it has seen free."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, hypot, pi

import numpy as np
from numpy.typing import NDArray

from stack.perception.tracking.clusters import beams_towards
from stack.types import FloatArray, Pose2D, Scan

BESIDE = 0.05
"""Metres to each side of a point in which no beam may end if the point is free."""

BEHIND = 0.15
"""Metres behind a point at which beams must not have ended if it is free."""


@dataclass(frozen=True, slots=True)
class View:
    """A scan and the pose of its sensor, map frame."""

    sensor: Pose2D
    scan: Scan

    def points(self, run: tuple[int, int]) -> FloatArray:
        """Return (n, 2) the returns of a run of beams, map frame."""
        beams = np.arange(*run) % self.scan.ranges.size
        return self.ends(beams[np.isfinite(self.scan.ranges[beams])])

    def ends(self, beams: NDArray[np.intp]) -> FloatArray:
        """Return (n, 2) where beams end that have returned, map frame."""
        ranges = self.scan.ranges[beams].astype(np.float64)
        angles = self.sensor.heading + self.scan.angles[beams]
        found: FloatArray = np.column_stack((np.cos(angles), np.sin(angles))) * ranges[:, None]
        found += self.sensor.x, self.sensor.y
        return found

    @property
    def origin(self) -> FloatArray:
        """(2,) position of the sensor, map frame."""
        return np.array([self.sensor.x, self.sensor.y])

    def across(self, centre: FloatArray, aside: float) -> FloatArray:
        """Return (3, 2) a point and two beside it as the sensor sees it, map frame."""
        towards = centre - self.origin
        side = np.array([-towards[1], towards[0]]) / max(hypot(*towards), 1e-6)
        found: FloatArray = centre + np.array([[-aside], [0.0], [aside]]) * side
        return found

    def share_passed(self, points: FloatArray) -> float:
        """Return the share of points (n, 2), map frame, past which all beams around them end.

        A beam that ends close behind a point may have met the same surface, and so may one beside
        it.
        """
        scan = self.scan
        if not len(points):
            return 0.0
        away = points - (self.sensor.x, self.sensor.y)
        distances = np.hypot(away[:, 0], away[:, 1])
        angles = np.arctan2(away[:, 1], away[:, 0]) - self.sensor.heading
        increment, count = abs(scan.angle_increment), scan.ranges.size
        middle = beams_towards(scan, angles)
        beside = ceil(BESIDE / max(float(distances.min()), BESIDE) / increment)
        beams = (middle[:, None] + np.arange(-beside, beside + 1)) % round(2.0 * pi / increment)
        ranges = np.append(scan.ranges, -np.inf)[np.minimum(beams, count)]  # -inf: not seen
        passed = ranges.min(axis=1) > distances + BEHIND
        return float(np.mean(passed & (distances + BEHIND < scan.range_max)))
