"""Views of range sensors in one form: how far each beam passed over free ground."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, Pose2D, RangeReading, RangeView, Scan, wrap_angle

HIDDEN_BEHIND = 0.1
"""Metres behind the end of a beam beyond which the space is hidden."""

SONAR_SPACING = 0.05
"""Metres between the beams that stand for the cone of a sonar, at the distance of its reading."""


@dataclass(frozen=True, slots=True)
class BeamView:
    """Evenly spaced beams of a range sensor, and the pose at which they were measured.

    Attributes:
        base: pose of the robot, odom frame.
        sensor: pose of the sensor, odom frame.
        ranges: (n,) metres; +inf: no return; NaN: invalid. If the robot stood, invalid beams are
            filled from an earlier measurement.
        angle_min: direction of beam 0, sensor frame, radians.
        angle_increment: angle from beam to beam, radians.
        range_max: metres.
    """

    base: Pose2D
    sensor: Pose2D
    ranges: FloatArray
    angle_min: float
    angle_increment: float
    range_max: float

    @classmethod
    def of(cls, view: RangeView) -> BeamView:
        """Convert a measurement."""
        measured = view.measurement
        beams = _of_sonar(measured) if isinstance(measured, RangeReading) else _of_scan(measured)
        return cls(view.base, view.base.compose(measured.mount), *beams, measured.range_max)

    def filled(self, older: BeamView) -> BeamView:
        """Return a copy whose invalid beams have the ranges of an older view of the same pose."""
        if self.ranges.shape != older.ranges.shape:
            return self
        return replace(self, ranges=np.where(np.isnan(self.ranges), older.ranges, self.ranges))

    def points(self) -> FloatArray:
        """(m, 2) end points of the beams that returned, odom frame, metres."""
        hit = np.flatnonzero(np.isfinite(self.ranges))
        angles, ranges = self.angle_min + self.angle_increment * hit, self.ranges[hit]
        return self.sensor.transform(
            np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
        )

    def shows(self, points: FloatArray) -> NDArray[np.bool_]:
        """(m,) whether this view sees the positions of points (m, 2), odom frame."""
        away = points - (self.sensor.x, self.sensor.y)
        turn = np.arctan2(away[:, 1], away[:, 0]) - self.sensor.heading - self.angle_min
        beam = np.rint((turn % (2.0 * np.pi)) / self.angle_increment).astype(np.int64)
        full_turn, count = round(2.0 * np.pi / self.angle_increment), self.ranges.size
        beam %= max(full_turn, count)
        reach = np.where(beam < count, self.ranges[np.minimum(beam, count - 1)], np.nan)
        shown: NDArray[np.bool_] = np.hypot(away[:, 0], away[:, 1]) <= reach + HIDDEN_BEHIND
        return shown


def is_near(one: Pose2D, other: Pose2D, distance: float, angle: float) -> bool:
    """Whether two poses differ by at most a distance in metres and an angle in radians."""
    if one.distance_to(other) > distance:
        return False
    return abs(wrap_angle(one.heading - other.heading)) <= angle


def _of_scan(scan: Scan) -> tuple[FloatArray, float, float]:
    """Return ranges, first angle and increment; the beams of a deskewed scan evenly spaced again.

    Each beam takes the range of the nearest measured one, and is invalid when that is more than
    one and a half increments away.
    """
    ranges = scan.ranges.astype(np.float64)
    if scan.bearings is None:
        return ranges, scan.angle_min, scan.angle_increment
    turn = 2.0 * np.pi
    measured = np.concatenate([scan.bearings - turn, scan.bearings, scan.bearings + turn])
    order = np.argsort(measured)
    measured = measured[order]
    even = scan.angle_min + scan.angle_increment * np.arange(ranges.size)
    after = np.searchsorted(measured, even)
    nearest = after - (even - measured[after - 1] < measured[after] - even)
    ranges = ranges[order[nearest] % ranges.size]
    ranges[np.abs(measured[nearest] - even) > 1.5 * scan.angle_increment] = np.nan
    return ranges, scan.angle_min, scan.angle_increment


def _of_sonar(reading: RangeReading) -> tuple[FloatArray, float, float]:
    """Return ranges, first angle and increment of beams that stand for the cone of a sonar."""
    width = reading.field_of_view
    reach = reading.distance if isfinite(reading.distance) else reading.range_max
    count = max(2, round(width * reach / SONAR_SPACING) + 1)
    return np.full(count, reading.distance), -width / 2.0, width / (count - 1)
