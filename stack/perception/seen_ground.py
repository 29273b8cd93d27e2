"""Seen ground: when each place around a robot that does not see all around was last seen.

A grid in the odom frame around the base. A cell is seen when every beam that crosses it passes
through it or ends in it, and while the robot stands on it. What stands in a cell where beams end is
the matter of the obstacle points; ground that was never seen may hold anything.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil, cos, inf, sin

import numpy as np

from stack.drivetrain.description import LidarDescription, RobotDescription, SonarDescription
from stack.geometry.polygons import fill_polygon
from stack.perception.rolling_grid import shifted
from stack.types import FloatArray, Pose2D, RangeReading, RangeView, Scan, SeenGround

CELL = 0.03
"""Side of a cell, metres."""

SLACK = 0.25
"""Metres that the base moves from the middle of the grid before the grid follows."""

REACH = 0.3
"""Metres around the robot's circumscribed circle that the grid covers at least. Towards what is
blind the robot drives slowly and needs less; turning keeps it within the circle."""


class GroundMemory:
    """Stamps of the ground around a robot.

    Args:
        robot: with its footprint and limits.
        sensors: its range sensors.
        margin: radians by which their views are narrower.
    """

    def __init__(
        self,
        robot: RobotDescription,
        sensors: Iterable[LidarDescription | SonarDescription],
        margin: float,
    ) -> None:
        from stack.perception import kernels

        self._kernels = kernels
        self._footprint = fill_polygon(robot.footprint.points, 0.7 * CELL)
        self._half = ceil((robot.footprint.circumscribed_radius + REACH + SLACK) / CELL)
        self._stamps = np.full((2 * self._half, 2 * self._half), -inf)
        self._corner = (-self._half, -self._half)  # column and row of the first cell, odom frame
        self._views = np.array([
            (s.mount.x, s.mount.y, cos(s.mount.heading), sin(s.mount.heading),
             0.5 * s.field_of_view - margin, s.range_min, s.range_max)
            for s in sensors
        ]).reshape(-1, 7)  # fmt: skip

    def update(self, views: Iterable[RangeView], base: Pose2D, now: float) -> None:
        """Stamp what new measurements see, and the ground below the robot.

        Args:
            views: the new measurements.
            base: pose of the base now, odom frame.
            now: seconds.
        """
        self._follow(base)
        for view in views:
            self._mark(view)
        column, row = self._corner
        cells = np.floor(base.transform(self._footprint) / CELL).astype(np.int64)
        self._stamps[cells[:, 1] - row, cells[:, 0] - column] = now

    def since(self, oldest: float, base: Pose2D) -> SeenGround:
        """Return the ground with the time from which on a stamp counts, and the base's pose."""
        column, row = self._corner
        return SeenGround(
            self._stamps.copy(), (column * CELL, row * CELL), CELL, oldest, base, self._views
        )

    def _mark(self, view: RangeView) -> None:
        measured = view.measurement
        sensor = view.base.compose(measured.mount)
        if isinstance(measured, Scan):
            angles, ranges = measured.angles, measured.ranges.astype(np.float64)
            if angles[0] > angles[-1]:
                angles, ranges = angles[::-1].copy(), ranges[::-1].copy()
        else:
            angles, ranges = _cone(measured)
        if len(angles) < 2:
            return
        column, row = self._corner
        self._kernels.mark_seen(
            self._stamps, column * CELL, row * CELL, CELL, sensor.x, sensor.y, sensor.heading,
            angles, ranges, measured.range_max, measured.stamp,
        )  # fmt: skip

    def _follow(self, base: Pose2D) -> None:
        """Move the grid with the base; cells that leave it are forgotten."""
        wanted = tuple(round(value / CELL) - self._half for value in (base.x, base.y))
        columns, rows = wanted[0] - self._corner[0], wanted[1] - self._corner[1]
        if max(abs(columns), abs(rows)) * CELL <= SLACK:
            return
        self._stamps = shifted(self._stamps, rows, columns, -inf)
        self._corner = (wanted[0], wanted[1])


def _cone(reading: RangeReading) -> tuple[FloatArray, FloatArray]:
    """Return the edges of a reading's cone as two beams: bearings and ranges."""
    half = 0.5 * reading.field_of_view
    return np.array([-half, half]), np.full(2, float(reading.distance))
