"""Obstacle memory: the newest points of every range sensor, and those in sectors nothing sees.

Every lidar and sonar counts alike. Points are kept in the odom frame at their own stamps, so that
the motion since a measurement is compensated by odometry. Points that the robot's motion moves into
a sector that no sensor covers are remembered for a while: a robot that is blind behind does not
reverse into what it has just passed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import cos, inf, isfinite, pi, sin

import numpy as np

from stack.drivetrain.description import LidarDescription, RobotDescription, SonarDescription
from stack.errors import FrameError
from stack.frames.buffer import TransformBuffer
from stack.parameters import parameter
from stack.types import (
    FloatArray,
    Observation,
    ObstaclePoints,
    Pose2D,
    RangeReading,
    RangeView,
    Scan,
    wrap_angle,
)

ARC_SPACING = 0.05
"""Metres between the points on the arc of a sonar reading."""

CELL = 0.02
"""Metres; remembered points closer than this are one."""

MARGIN = 0.05
"""Radians by which blind sectors are widened for the memory, so that no point is lost between the
last beam and the sector."""

BEARINGS = 720
"""Bearings at which coverage is computed."""


@dataclass(frozen=True)
class ObstacleMemoryParameters:
    """Which obstacles are remembered."""

    blind_time: float = parameter(
        10.0, "s", at_least=0.0, help="how long points are remembered in sectors nothing sees"
    )
    blind_range: float = parameter(
        2.0, "m", at_least=0.0, help="largest distance of remembered points"
    )


@dataclass(frozen=True, slots=True)
class _Measured:
    """One measurement: its points (n, 2), base frame at its stamp, and its view."""

    points: FloatArray
    view: RangeView

    @property
    def stamp(self) -> float:
        """Of the measurement, seconds."""
        return self.view.measurement.stamp


class ObstacleMemory:
    """Collects the measurements of all range sensors of a robot.

    Args:
        robot: with its lidars and sonars.
        parameters: of the memory.
    """

    def __init__(
        self,
        robot: RobotDescription,
        parameters: ObstacleMemoryParameters = ObstacleMemoryParameters(),
    ) -> None:
        self.parameters = parameters
        self._sensors = (*robot.all_lidars, *robot.sonars)
        self._newest: dict[str, _Measured] = {}
        self._blind_sectors = blind_sectors(robot)
        self._remembered: FloatArray = np.empty((0, 3))

    def configure(self, parameters: ObstacleMemoryParameters) -> None:
        """Apply new parameters; remembered points stay."""
        self.parameters = parameters

    def update(self, observation: Observation, frames: TransformBuffer) -> ObstaclePoints:
        """Process new measurements; return all points, compensated to the observation's time.

        Args:
            observation: with deskewed, smoothed scans.
            frames: with the odometry up to the observation's time.
        """
        now = observation.time
        for name, scan in observation.of(Scan).items():
            view = RangeView(frames.pose_at("odom", scan.stamp), scan)
            self._newest[name] = _Measured(scan.points(), view)
        for name, reading in observation.of(RangeReading).items():
            view = RangeView(frames.pose_at("odom", reading.stamp), reading)
            self._newest[name] = _Measured(arc_points(reading), view)
        visible = self._compensated(now, frames)
        remembered = self._remember(visible, now, frames)
        ages = {name: self._age(name, now) for name in self._sensors}
        points = np.concatenate([visible, remembered]) if len(remembered) else visible
        views = {name: measured.view for name, measured in self._newest.items()}
        return ObstaclePoints(now, points, ages, self._blind_sectors, views)

    def _age(self, name: str, now: float) -> float:
        return now - self._newest[name].stamp if name in self._newest else inf

    def _compensated(self, now: float, frames: TransformBuffer) -> FloatArray:
        """Return (m, 2) the newest points of every sensor, base frame now."""
        found = [np.empty((0, 2))]
        for name in self._sensors:
            if name not in self._newest:
                continue
            measured = self._newest[name]
            try:
                moved = frames.motion(measured.stamp, now)
            except FrameError:
                continue  # too old; its age says so
            found.append(moved.inverse().transform(measured.points))
        return np.concatenate(found)

    def _remember(self, visible: FloatArray, now: float, frames: TransformBuffer) -> FloatArray:
        """Return (m, 2) remembered points in blind sectors, base frame now; remember `visible`."""
        p = self.parameters
        if not len(self._blind_sectors) or p.blind_time == 0.0:
            return np.empty((0, 2))
        pose = frames.pose_at("odom", now)
        old = self._remembered[self._remembered[:, 2] > now - p.blind_time]
        local = pose.inverse().transform(old[:, :2])
        hidden = self._is_hidden(local)
        seen = pose.transform(visible[np.hypot(visible[:, 0], visible[:, 1]) <= p.blind_range])
        fresh = np.column_stack([seen, np.full(len(seen), now)])
        self._remembered = _thinned(np.concatenate([fresh, old[hidden]]))
        return local[hidden]

    def _is_hidden(self, points: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return (n,) whether points are within the range of the memory, in a blind sector."""
        bearings = np.arctan2(points[:, 1], points[:, 0])[:, None]
        turn = (bearings - self._blind_sectors[:, 0] + MARGIN) % (2.0 * pi)
        near = np.hypot(points[:, 0], points[:, 1]) <= self.parameters.blind_range
        hidden: np.ndarray[tuple[int], np.dtype[np.bool_]] = near & np.any(
            turn <= self._blind_sectors[:, 1] + 2.0 * MARGIN, axis=1
        )
        return hidden


def _thinned(rows: FloatArray) -> FloatArray:
    """Return the first of all rows (x, y, stamp) in the same cell; their order is kept."""
    cells = np.floor(rows[:, :2] / CELL).astype(np.int64)
    _, first = np.unique(cells, axis=0, return_index=True)
    return rows[np.sort(first)]


def arc_points(reading: RangeReading) -> FloatArray:
    """Return (n, 2) points on the arc of a reading, base frame; the obstacle is somewhere on it."""
    if not isfinite(reading.distance):
        return np.empty((0, 2))
    width = reading.field_of_view
    count = max(2, round(width * reading.distance / ARC_SPACING) + 1)
    bearings = np.linspace(-width / 2.0, width / 2.0, count)
    return reading.mount.transform(
        reading.distance * np.column_stack([np.cos(bearings), np.sin(bearings)])
    )


def blind_sectors(robot: RobotDescription) -> FloatArray:
    """Return (k, 2) first bearing and width of the sectors that no range sensor covers, radians.

    A bearing is covered if a point in this direction, half a metre outside the footprint, is
    within the field of view of a sensor.
    """
    sensors: list[LidarDescription | SonarDescription] = [
        *robot.all_lidars.values(), *robot.sonars.values(),
    ]  # fmt: skip
    distance = robot.footprint.circumscribed_radius + 0.5
    step = 2.0 * pi / BEARINGS
    covered = [
        any(_sees(sensor, distance, -pi + step * n) for sensor in sensors) for n in range(BEARINGS)
    ]
    return _runs(covered, step)


def _sees(sensor: LidarDescription | SonarDescription, distance: float, bearing: float) -> bool:
    point = Pose2D(distance * cos(bearing), distance * sin(bearing)).relative_to(sensor.mount)
    off = abs(wrap_angle(np.arctan2(point.y, point.x)))
    return off <= sensor.field_of_view / 2.0 + 1e-9


def _runs(covered: Iterable[bool], step: float) -> FloatArray:
    """Return (k, 2) first bearing and width of the runs of False, joined across half a turn."""
    flags = list(covered)
    if not any(flags):
        return np.array([[-pi, 2.0 * pi]])
    begin = flags.index(True)
    rows, length = [], 0
    for n in range(begin, begin + len(flags) + 1):
        if n < begin + len(flags) and not flags[n % len(flags)]:
            length += 1
        elif length:
            rows.append((wrap_angle(-pi + step * (n - length)), step * (length - 1)))
            length = 0
    return np.array(rows).reshape(-1, 2)
