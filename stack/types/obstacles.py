"""Obstacles that the range sensors see, in the form that every consumer receives."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from stack.types.geometry import FloatArray, Pose2D
from stack.types.sensors import RangeReading, Scan


def _none() -> FloatArray:
    return np.empty((0, 2))


def _nothing() -> FloatArray:
    return np.empty((0, 3))


@dataclass(frozen=True, slots=True)
class RangeView:
    """A measurement of a range sensor, with the pose at which it was taken.

    Attributes:
        base: pose of the base at the measurement's stamp, odom frame.
        measurement: a deskewed scan, or a reading.
    """

    base: Pose2D
    measurement: Scan | RangeReading


@dataclass(frozen=True, slots=True)
class SeenGround:
    """When the ground around a robot was last seen, for a robot that does not see all around.

    Attributes:
        stamps: (rows, columns) seconds at which each cell was last seen, or the robot stood on it;
            -inf: never. Row 0 is the lowest y.
        corner: x and y of the outer corner of the first cell, odom frame, metres.
        cell: side of a cell, metres.
        oldest: seconds; a cell with an earlier stamp counts as unseen.
        base: pose of the base now, odom frame.
        views: (k, 7) of the range sensors in the base frame: x and y, cosine and sine of the
            heading, half the field of view (radians), least and largest range (metres).
    """

    stamps: FloatArray
    corner: tuple[float, float]
    cell: float
    oldest: float
    base: Pose2D
    views: FloatArray

    def is_unseen(self, x: float, y: float) -> bool:
        """Return whether a point, base frame, is on unseen ground; outside the grid it is."""
        point = self.base.transform(np.array([[x, y]]))[0]
        column, row = np.floor((point - self.corner) / self.cell).astype(int)
        rows, columns = self.stamps.shape
        inside = 0 <= row < rows and 0 <= column < columns
        return not inside or bool(self.stamps[row, column] < self.oldest)


@dataclass(frozen=True, slots=True)
class DepthPoints:
    """Obstacles that the depth cameras have seen.

    Attributes:
        points: (n, 2) odom frame, metres; of those above each other only one.
        ages: seconds since the newest usable picture of each depth camera; inf before the first.
        changed: whether the points have changed since the last step.
        spatial: (m, 3) all points, odom frame, metres; z is 0 where the floor is missing.
    """

    points: FloatArray = field(default_factory=_none)
    ages: Mapping[str, float] = field(default_factory=dict)
    changed: bool = False
    spatial: FloatArray = field(default_factory=_nothing)


NO_DEPTH = DepthPoints()


@dataclass(frozen=True, slots=True)
class ObstaclePoints:
    """Newest points of all range sensors, compensated for the motion since each measurement.

    Attributes:
        stamp: seconds on the body's clock, to which the points are compensated.
        points: (m, 2) base frame at `stamp`, metres.
        ages: seconds since the newest measurement of each range sensor of the robot; inf before
            the first one.
        blind_sectors: (k, 2) first bearing and width of the sectors around the base that no sensor
            covers, radians; the last one may cross half a turn.
        views: newest measurement of each range sensor by name, for free ground along the beams.
        ground: which ground around the robot was seen; None if the sensors see all around.
    """

    stamp: float = 0.0
    points: FloatArray = field(default_factory=_none)
    ages: Mapping[str, float] = field(default_factory=dict)
    blind_sectors: FloatArray = field(default_factory=_none)
    views: Mapping[str, RangeView] = field(default_factory=dict)
    ground: SeenGround | None = None

    def are_blind(self, bearings: FloatArray) -> NDArray[np.bool_]:
        """(n,) whether no sensor covers bearings (n,) from the base, radians."""
        turns = (bearings[:, None] - self.blind_sectors[:, 0]) % (2.0 * np.pi)
        return np.asarray((turns <= self.blind_sectors[:, 1]).any(axis=1))

    def is_blind(self, bearing: float) -> bool:
        """Return whether no sensor covers a bearing, radians in the base frame."""
        if not len(self.blind_sectors):
            return False
        return bool(self.are_blind(np.array([bearing]))[0])
