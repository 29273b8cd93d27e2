"""Odometry since the last measurement update, at which the poses of the particles stand."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from stack.frames.buffer import TransformBuffer
from stack.localisation.planar import lever, rotation
from stack.types import FloatArray, Pose2D

_ORIGIN = Pose2D(0.0, 0.0)

UPDATE_DISTANCE, UPDATE_ANGLE = 0.05, 0.05
"""Metres driven or radians turned between two measurement updates: about a cell of the map."""

_STILL_UPDATES = 2
"""Largest number of measurement updates at standstill: the same view adds little evidence."""


@dataclass(frozen=True, slots=True)
class MotionSince:
    """An odometry displacement, with what odometry states of it.

    Attributes:
        moved: in the base frame at its start.
        covariance: (3, 3) of `moved`, in that frame.
        disturbed: whether wheels and another sensor disagreed on the way.
    """

    moved: Pose2D
    covariance: FloatArray
    disturbed: bool = False

    @staticmethod
    def none() -> MotionSince:
        """No motion."""
        return MotionSince(Pose2D(0.0, 0.0), np.zeros((3, 3)))

    def then(self, moved: Pose2D, covariance: FloatArray | None, disturbed: bool) -> MotionSince:
        """Return this displacement followed by another, whose covariance is in its own frame."""
        if covariance is None or not covariance.any():
            total = self.covariance
        else:
            change, turn = lever(self.moved.heading, moved), rotation(self.moved.heading)
            total = change @ self.covariance @ change.T + turn @ covariance @ turn.T
        return MotionSince(self.moved.compose(moved), total, self.disturbed or disturbed)


class OdometrySince:
    """Odometry since the last measurement update, and when the next one is due.

    Attributes:
        pose: the newest, odom frame; None before the first.
        reference: at the last measurement update or restart, odom frame.
        stated: what odometry states of the motion from there to the last scan.
    """

    def __init__(self) -> None:
        self.pose: Pose2D | None = None
        self._scanned: tuple[float, Pose2D] | None = None
        self.restart()

    def restart(self) -> None:
        """Begin at the newest odometry."""
        self._begin()
        self._still_scans = 0

    def _begin(self) -> None:
        self.reference = self.pose or _ORIGIN
        self.stated = MotionSince.none()

    def add(self, pose: Pose2D) -> None:
        """Add the newest pose, odom frame."""
        if self.pose is None:
            self.reference = pose
        self.pose = pose

    @property
    def moved(self) -> Pose2D:
        """The displacement, in the base frame at its start."""
        return (self.pose or self.reference).relative_to(self.reference)

    def stated_errors(
        self, frames: TransformBuffer, stamp: float
    ) -> tuple[FloatArray | None, bool]:
        """Return covariance and disturbance of the motion from the last scan to a stamp.

        The covariance is None if odometry states none.
        """
        if self._scanned is None or not frames.covers(self._scanned[0]):
            return None, False
        since = self._scanned[0]
        return frames.motion_covariance(since, stamp), frames.disturbed_between(since, stamp)

    def add_scan(
        self, stamp: float, covariance: FloatArray | None, *, disturbed: bool
    ) -> tuple[float, float]:
        """Add a scan at the newest pose; return distance (m) and turn (rad) since the last one.

        Args:
            stamp: of the scan, seconds.
            covariance: (3, 3) of the motion since the last scan, in the base frame there.
            disturbed: whether odometry was disturbed since then.
        """
        assert self.pose is not None
        before = self._scanned[1] if self._scanned is not None else self.pose
        step = self.pose.relative_to(before)
        self.stated = self.stated.then(step, covariance, disturbed)
        self._scanned = stamp, self.pose
        return hypot(step.x, step.y), abs(step.heading)

    def seconds_to(self, stamp: float) -> float:
        """Return the seconds from the last scan to a stamp; 0 before the first one."""
        return 0.0 if self._scanned is None else max(0.0, stamp - self._scanned[0])

    def doubt_standstill(self) -> None:
        """Let the next scan weight the particles although the wheels stand."""
        self._still_scans = 0

    def is_update_due(self, *, settled: bool) -> bool:
        """Return whether the scan that was added last should weight the particles.

        Args:
            settled: whether the particles are close together; they then need one update at
                standstill, else two.
        """
        moved = self.moved
        if moved.distance_to(_ORIGIN) >= UPDATE_DISTANCE or abs(moved.heading) >= UPDATE_ANGLE:
            self._still_scans = 0
            return True
        self._still_scans += 1
        return self._still_scans <= (1 if settled else _STILL_UPDATES)

    def take(self) -> MotionSince:
        """Return the motion for a measurement update, and start again."""
        motion = MotionSince(self.moved, self.stated.covariance, self.stated.disturbed)
        self._begin()
        return motion
