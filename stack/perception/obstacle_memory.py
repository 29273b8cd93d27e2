"""Obstacle memory: the newest points of every range sensor, and those in sectors nothing sees.

Every lidar and sonar counts alike. Points are kept in the odom frame at their own stamps, so that
the motion since a measurement is compensated by odometry. Points that the robot's motion moves into
a sector that no sensor covers are remembered for a while: a robot that is blind behind does not
reverse into what it has just passed. People who walk into such a sector are expected where they
were seen last for a short time only: they go on, or stop behind the robot. The arc of a sonar
reading that shows a person is left out: a lidar shows where they are. Such a robot also remembers
which ground it has seen (stack/perception/seen_ground.py).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import inf, isfinite, pi, radians

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.drivetrain.description import LidarDescription, RobotDescription, SonarDescription
from stack.frames.buffer import TransformBuffer
from stack.parameters import parameter
from stack.perception.seen_ground import GroundMemory
from stack.perception.tracking.people_mask import is_echo_of
from stack.types import (
    NO_DEPTH,
    TRACK_PADDING,
    DepthPoints,
    FloatArray,
    Observation,
    ObstaclePoints,
    Pose2D,
    RangeReading,
    RangeView,
    Scan,
    SeenGround,
    TrackedObject,
    wrap_angle,
)

STATIC_TIME = 60.0
"""How long points are remembered that were seen in one place for STATIC_AFTER, s: things stay."""
WALKING_TIME = 3.0
"""The same for points of people who walked, s: they go on."""
BLIND_RANGE = 2.0
"""Largest distance of remembered points, m."""
DEPTH_RANGE = 3.0
"""Largest distance of points from depth cameras, m."""
SEEN_TIME = 10.0
"""How long ground in sectors nothing sees counts as seen, s."""

ARC_SPACING = 0.05
"""Metres between the points on the arc of a sonar reading."""

CELL = 0.02
"""Metres; remembered points closer than this are one."""

PLACE, STATIC_AFTER = 0.1, 2.0
"""Side of a place in metres, and seconds from the first to the last sighting after which what
stands there counts as static. A person who walks leaves it earlier."""

WALKING_SPEED = 0.2
"""Speed in m/s from which a person walks."""

MARGIN = 0.05
"""Radians by which the view of a sensor is narrowed for the memory, so that no point is lost
between the last beam and the edge of the view."""

Sensor = LidarDescription | SonarDescription

NARROW_MASK = radians(20.0)
"""Masks up to this hide nothing that stays hidden: it is as wide as a person 1 m away, and the next
motion shows it."""

BEARINGS = 720
"""Bearings at which coverage is computed."""


@dataclass(frozen=True)
class ObstacleMemoryParameters:
    """Which obstacles are remembered."""

    blind_time: float = parameter(
        10.0, "s", at_least=0.0, help="how long points are remembered in sectors nothing sees"
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
    """Collects the measurements of all range sensors of a robot."""

    @staticmethod
    def kernels(robot: RobotDescription) -> KernelTypes:
        """Return the kernels of the memory; none if the robot's sensors see all around."""
        if not len(blind_sectors(robot)):
            return ()
        from stack.perception import kernels

        return kernels.MARK_SEEN

    def __init__(
        self,
        robot: RobotDescription,
        parameters: ObstacleMemoryParameters = ObstacleMemoryParameters(),
    ) -> None:
        self.parameters = parameters
        self._sensors: Mapping[str, Sensor] = {**robot.all_lidars, **robot.sonars}
        self._newest: dict[str, _Measured] = {}
        self._views: Mapping[str, RangeView] = {}
        self._blind_sectors = blind_sectors(robot)
        self._ground = (
            GroundMemory(robot, self._sensors.values(), MARGIN)
            if len(self._blind_sectors)
            else None
        )
        self._remembered: FloatArray = np.empty((0, 4))  # x, y, last and first sighting

    def configure(self, parameters: ObstacleMemoryParameters) -> None:
        """Apply new parameters; remembered points stay."""
        self.parameters = parameters

    def update(
        self, observation: Observation, frames: TransformBuffer, depth: DepthPoints = NO_DEPTH,
        tracks: Sequence[TrackedObject] = (),
    ) -> ObstaclePoints:  # fmt: skip
        """Process new measurements; return all points, compensated to the observation's time.

        Args:
            observation: with deskewed, smoothed scans.
            frames: with the odometry up to the observation's time.
            depth: what the depth cameras have seen.
            tracks: moving objects, map frame.
        """
        now = observation.time
        new: dict[str, _Measured] = {}
        for name, scan in observation.of(Scan).items():
            view = RangeView(frames.pose_at("odom", scan.stamp), scan)
            new[name] = _Measured(scan.points(), view)
        for name, reading in observation.of(RangeReading).items():
            view = RangeView(frames.pose_at("odom", reading.stamp), reading)
            seen = bool(tracks) and is_echo_of(
                reading, frames.pose_at("map", reading.stamp), [t.at(reading.stamp) for t in tracks]
            )
            new[name] = _Measured(np.empty((0, 2)) if seen else arc_points(reading), view)
        here = frames.pose_at("odom", now)
        if new:
            self._newest.update(new)
            self._views = {name: measured.view for name, measured in self._newest.items()}
        visible = self._compensated(here, frames)
        remembered = self._remember(visible, now, frames, tracks, fresh=bool(new))
        ground = self._see_ground([measured.view for measured in new.values()], now, here)
        ages = {name: self._age(name, now) for name in self._sensors}
        near = _near(depth.points, here, DEPTH_RANGE)
        more = [part for part in (remembered, near) if len(part)]
        points = np.concatenate([visible, *more]) if more else visible
        return ObstaclePoints(
            now, points, {**ages, **depth.ages}, self._blind_sectors, self._views, ground
        )

    def _see_ground(
        self, views: Sequence[RangeView], now: float, here: Pose2D
    ) -> SeenGround | None:
        """Return the ground that was seen; None if the sensors see all around."""
        if self._ground is None:
            return None
        self._ground.update(views, here, now)
        return self._ground.since(now - SEEN_TIME, here)

    def _age(self, name: str, now: float) -> float:
        return now - self._newest[name].stamp if name in self._newest else inf

    def _compensated(self, here: Pose2D, frames: TransformBuffer) -> FloatArray:
        """Return (m, 2) the newest points of every sensor, base frame at its pose now."""
        found, to_base = [np.empty((0, 2))], here.inverse()
        for name in self._sensors:
            measured = self._newest.get(name)
            # one before the start of the buffer is too old; its age says so
            if measured is not None and frames.covers(measured.stamp) and len(measured.points):
                found.append(to_base.compose(measured.view.base).transform(measured.points))
        return np.concatenate(found)

    def _remember(
        self, visible: FloatArray, now: float, frames: TransformBuffer,
        tracks: Sequence[TrackedObject], *, fresh: bool,
    ) -> FloatArray:  # fmt: skip
        """Return (m, 2) remembered points in blind sectors, base frame now.

        The newest points (n, 2) are remembered if they are `fresh`.
        """
        p = self.parameters
        if not len(self._blind_sectors) or p.blind_time == 0.0:
            return np.empty((0, 2))
        pose = frames.pose_at("odom", now)
        known = self._remembered
        local = pose.inverse().transform(known[:, :2])
        static = known[:, 2] - known[:, 3] >= STATIC_AFTER
        recent = known[:, 2] > now - np.where(static, STATIC_TIME, p.blind_time)
        hidden = recent & self._is_hidden(local)
        if not fresh:
            return local[hidden]
        seen = pose.transform(visible[np.hypot(visible[:, 0], visible[:, 1]) <= BLIND_RANGE])
        new = np.column_stack([seen, np.full((len(seen), 2), now)])
        walking = [track.at(now) for track in tracks if track.speed >= WALKING_SPEED]
        if walking:  # as old as what is remembered for walking_time only
            theirs = _on(new, walking, frames.map_from_odom(now).inverse())
            new[theirs, 2:] -= max(0.0, p.blind_time - WALKING_TIME)
        rows = _with_first_sightings(np.concatenate([new, known]))
        kept = np.concatenate([np.ones(len(new), dtype=bool), hidden])
        self._remembered = _thinned(rows[kept])
        return local[hidden]

    def _is_hidden(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return (n,) whether points are within the range of the memory, where nothing sees."""
        hidden = np.hypot(points[:, 0], points[:, 1]) <= BLIND_RANGE
        for sensor in self._sensors.values():
            hidden[hidden] = ~_covers(sensor, points[hidden], MARGIN)
        return hidden


def _near(points: FloatArray, base: Pose2D, reach: float) -> FloatArray:
    """Return (m, 2) the points (n, 2), odom frame, within reach of the base, in its frame."""
    if not len(points):
        return points
    away = points - (base.x, base.y)
    near = np.einsum("ij,ij->i", away, away) <= reach * reach
    return base.inverse().transform(points[near])


def _on(
    rows: FloatArray, walking: Sequence[TrackedObject], odom_from_map: Pose2D
) -> NDArray[np.bool_]:
    """Return (n,) which of the rows (x, y, …), odom frame, are on people, map frame."""
    centres = odom_from_map.transform(np.array([track.position for track in walking]))
    away = np.hypot(*(rows[:, None, :2] - centres).transpose(2, 0, 1))
    found: NDArray[np.bool_] = (away <= np.array([t.radius for t in walking]) + TRACK_PADDING).any(
        axis=1
    )
    return found


def _thinned(rows: FloatArray) -> FloatArray:
    """Return the first of all rows (x, y, …) in the same cell; their order is kept."""
    column, row = np.floor(rows[:, :2] / CELL).astype(np.int64).T
    _, first = np.unique((column << 32) + row, return_index=True)
    return rows[np.sort(first)]


def _with_first_sightings(rows: FloatArray) -> FloatArray:
    """Return rows (x, y, last, first) with the earliest first sighting at each place.

    Four grids of places overlap by half, so that a point at the edge of one is inside another.
    """
    first = rows[:, 3].copy()
    if not len(rows):
        return rows
    halves = np.floor(rows[:, :2] / (0.5 * PLACE)).astype(np.int64)
    halves -= halves.min(axis=0)
    columns = halves[:, 0].max() // 2 + 2
    for shift in ((0, 0), (0, 1), (1, 0), (1, 1)):
        column, row = ((halves + shift) // 2).T
        place = row * columns + column
        earliest = np.full(place.max() + 1, inf)
        np.minimum.at(earliest, place, rows[:, 3])
        np.minimum(first, earliest[place], out=first)
    return np.column_stack([rows[:, :3], first])


def arc_points(reading: RangeReading) -> FloatArray:
    """Return (n, 2) points on the arc of a reading, base frame; the obstacle is somewhere on it."""
    if not isfinite(reading.distance):
        return np.empty((0, 2))
    width = reading.field_of_view
    count = max(2, round(width * reading.distance / ARC_SPACING) + 1)
    return reading.mount.transform(reading.distance * _unit_arc(width, count))


@lru_cache(maxsize=1024)
def _unit_arc(width: float, count: int) -> FloatArray:
    """Return (count, 2) evenly spaced points of an arc of radius 1 about the x axis; read only."""
    bearings = np.linspace(-width / 2.0, width / 2.0, count)
    points = np.column_stack([np.cos(bearings), np.sin(bearings)])
    points.setflags(write=False)
    return points


def blind_sectors(robot: RobotDescription) -> FloatArray:
    """Return (k, 2) first bearing and width of the sectors that no range sensor covers, radians.

    A bearing is covered if a point in this direction, half a metre outside the footprint, is
    within the field of view of a sensor.
    """
    sensors: list[Sensor] = [*robot.all_lidars.values(), *robot.sonars.values()]
    distance = robot.footprint.circumscribed_radius + 0.5
    step = 2.0 * pi / BEARINGS
    bearings = -pi + step * np.arange(BEARINGS)
    ring = distance * np.column_stack([np.cos(bearings), np.sin(bearings)])
    covered = np.zeros(BEARINGS, dtype=bool)
    for sensor in sensors:
        covered |= _covers(sensor, ring)
    return _runs(covered.tolist(), step)


def _covers(sensor: Sensor, points: FloatArray, margin: float = 0.0) -> NDArray[np.bool_]:
    """Return (n,) whether points (n, 2), base frame, are in the view of a sensor.

    A point hidden behind an obstacle counts as covered. The field of view is narrower by a margin
    in radians on both sides.
    """
    local = sensor.mount.inverse().transform(points)
    away = np.hypot(local[:, 0], local[:, 1])
    covered: NDArray[np.bool_] = (away >= sensor.range_min) & (away <= sensor.range_max)
    if sensor.field_of_view < 2.0 * pi - 1e-6:
        off = np.abs(np.arctan2(local[:, 1], local[:, 0]))
        covered &= off <= sensor.field_of_view / 2.0 - margin + 1e-9
    if isinstance(sensor, LidarDescription) and sensor.mask:
        covered &= ~sensor.masks(np.arctan2(local[:, 1], local[:, 0]), NARROW_MASK)
    return covered


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
