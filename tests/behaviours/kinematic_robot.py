"""A unicycle between polygon walls with a noisy lidar: enough world to follow walls in."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, pi, sin

import numpy as np

from behaviours.testing import ScriptedRobot
from stack.streams import stream
from stack.types import STANDSTILL, ContactZone, FloatArray, Pose2D, Scan, Twist, wrap_angle

PERIOD = 0.05
LINEAR_ACCELERATION, ANGULAR_ACCELERATION = 1.0, 3.2
RANGE_MAX, RANGE_MIN = 12.0, 0.08


def segments_of(*polylines: list[tuple[float, float]]) -> FloatArray:
    """(n, 4) wall segments x1, y1, x2, y2 of polylines."""
    return np.array([(*a, *b) for line in polylines for a, b in pairwise(line)])


def cast_rays(segments: FloatArray, pose: Pose2D, angles: FloatArray) -> FloatArray:
    """(n,) distances to the nearest segment along each beam; inf where there is none."""
    start, end = segments[:, :2], segments[:, 2:]
    edge, reach = end - start, start - (pose.x, pose.y)
    direction = np.column_stack([np.cos(angles + pose.heading), np.sin(angles + pose.heading)])
    cross = direction[:, None, 0] * edge[None, :, 1] - direction[:, None, 1] * edge[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distance = (reach[:, 0] * edge[:, 1] - reach[:, 1] * edge[:, 0])[None, :] / cross
        share = (
            reach[None, :, 0] * direction[:, None, 1] - reach[None, :, 1] * direction[:, None, 0]
        ) / cross
    hit = (distance > 0.0) & (share >= 0.0) & (share <= 1.0)
    return np.where(hit, distance, np.inf).min(axis=1, initial=np.inf)


def clearance(segments: FloatArray, pose: Pose2D) -> float:
    """Metres from a position to the nearest wall."""
    start, edge = segments[:, :2], segments[:, 2:] - segments[:, :2]
    reach = np.array([pose.x, pose.y]) - start
    share = np.clip((reach * edge).sum(axis=1) / (edge**2).sum(axis=1), 0.0, 1.0)
    return float(np.linalg.norm(reach - share[:, None] * edge, axis=1).min())


@dataclass
class KinematicRobot(ScriptedRobot):
    """Drives at 20 Hz, scans at 10 Hz with 1 cm noise, and records its path.

    Attributes:
        way: true poses, one each control period.
        odometry_scale: the odometry's distances are this many times the true ones.
        field_of_view: of the lidar, radians.
    """

    segments: FloatArray = field(default_factory=lambda: np.empty((0, 4)))
    seed: int = 1
    beams: int = 360
    field_of_view: float = 2.0 * pi
    odometry_scale: float = 1.0
    way: list[Pose2D] = field(default_factory=list)
    steps: int = 0
    alive_until: float = 0.0

    def __post_init__(self) -> None:
        self._scan()

    def drive_for(
        self, twist: Twist, seconds: float, *, while_lost: bool = False,
        contact: ContactZone | None = None, gives_way: bool = False,
    ) -> None:  # fmt: skip
        super().drive_for(
            twist, seconds, while_lost=while_lost, contact=contact, gives_way=gives_way
        )
        self.alive_until = self.time + seconds

    def advance(self, seconds: float) -> None:
        for _ in range(round(seconds / PERIOD)):
            self._step()

    def _step(self) -> None:
        wanted = self.twist if self.time < self.alive_until else STANDSTILL
        linear = self._towards(self.speed.linear, wanted.linear, LINEAR_ACCELERATION)
        angular = self._towards(self.speed.angular, wanted.angular, ANGULAR_ACCELERATION)
        self.speed = Twist(linear, angular)
        self.pose = self._moved(self.pose, linear * PERIOD, angular * PERIOD)
        scaled = linear * PERIOD * self.odometry_scale
        self.odometry = self._moved(self.odometry, scaled, angular * PERIOD)
        self.way.append(self.pose)
        self.steps += 1
        self.time = round(self.steps * PERIOD, 9)
        if self.steps % 2 == 0:
            self._scan()

    @staticmethod
    def _towards(now: float, wanted: float, acceleration: float) -> float:
        change = acceleration * PERIOD
        return now + min(max(wanted - now, -change), change)

    @staticmethod
    def _moved(pose: Pose2D, distance: float, turn: float) -> Pose2D:
        middle = pose.heading + 0.5 * turn
        return Pose2D(
            pose.x + distance * cos(middle),
            pose.y + distance * sin(middle),
            wrap_angle(pose.heading + turn),
        )

    def _scan(self) -> None:
        increment = self.field_of_view / self.beams
        angles = -0.5 * self.field_of_view + increment * np.arange(self.beams)
        ranges = cast_rays(self.segments, self.pose, angles)
        noise = stream(self.seed, "lidar", self.steps)
        ranges = ranges + noise.normal(0.0, 0.01, self.beams)
        ranges[noise.random(self.beams) < 0.005] = np.nan
        ranges[ranges < RANGE_MIN] = np.nan
        ranges[ranges > RANGE_MAX] = np.inf
        self.scan = Scan(
            self.time, ranges.astype(np.float32), angles[0], increment, RANGE_MIN, RANGE_MAX
        )
