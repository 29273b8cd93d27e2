"""Drives through buildings without physics: scans cast from the plan, odometry with errors."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import ceil, hypot, pi

import numpy as np

from stack.streams import stream
from stack.types import FloatArray, Pose2D, Scan, wrap_angle
from tests.benchmarks.buildings.plans import Building

STEP, TURN = 0.3, 0.3
"""Metres and radians between two scans."""

PERIOD = 0.3
"""Seconds between two scans."""

BEAMS, VIEW, LONGEST, NOISE = 271, 1.5 * pi, 20.0, 0.01
"""Beams, field of view (rad), longest range and deviation of a range (m) of the lidar."""

REFLECTION = 0.35
"""Radians from the normal within which glass reflects a beam."""

SCALE, SLIP_SHARE, SLIP = 0.02, 0.01, (0.15, 0.06)
"""Scale error of odometry; share of the steps that slip, and by how much: metres, radians."""

DRIFT = 0.004
"""Radians: deviation of the heading by odometry after each step."""


@dataclass(frozen=True)
class Step:
    """Truth, odometry and scan of one instant."""

    truth: Pose2D
    odometry: Pose2D
    scan: Scan


def drive(plan: Building, seed: int) -> list[Step]:
    """Return the steps of a drive along the route of a building."""
    rng = stream(seed, "drive")
    truth = poses_along(plan.route, rng)
    wheels = Wheels(truth[0], rng)
    return [
        Step(pose, wheels.at(pose), scan_at(plan, pose, PERIOD * k, rng))
        for k, pose in enumerate(truth)
    ]


class Wheels:
    """Odometry with a scale error, drift and slip, from a first pose on."""

    def __init__(self, start: Pose2D, rng: np.random.Generator) -> None:
        self._rng, self._true, self._measured = rng, start, start
        self._scale = 1.0 + SCALE * float(rng.choice([-1.0, 1.0]))

    def at(self, pose: Pose2D) -> Pose2D:
        """Return the odometry at the next pose."""
        moved, self._true = pose.relative_to(self._true), pose
        if moved != Pose2D(0.0, 0.0):
            self._measured = self._measured.compose(_measured(moved, self._scale, self._rng))
        return self._measured


def scan_at(plan: Building, pose: Pose2D, stamp: float, rng: np.random.Generator) -> Scan:
    """Return the scan from a pose, with noise."""
    ranges = cast(plan, pose) + rng.normal(0.0, NOISE, BEAMS)
    return Scan(
        stamp, np.where(ranges > LONGEST, np.inf, ranges).astype(np.float32),
        -0.5 * VIEW, VIEW / (BEAMS - 1), 0.05, LONGEST,
    )  # fmt: skip


def poses_along(route: tuple[tuple[float, float], ...], rng: np.random.Generator) -> list[Pose2D]:
    """Return poses along a route, a bit off the axis, with turns on the spot."""
    poses: list[Pose2D] = []
    off = 0.15 * rng.normal(size=2)
    for (x, y), (to_x, to_y) in pairwise([(a + off[0], b + off[1]) for a, b in route]):
        heading = float(np.arctan2(to_y - y, to_x - x))
        if poses:
            before = poses[-1].heading
            turn = wrap_angle(heading - before)
            count = max(1, ceil(abs(turn) / TURN))
            poses += [Pose2D(x, y, before + turn * k / count) for k in range(1, count + 1)]
        count = max(1, round(hypot(to_x - x, to_y - y) / STEP))
        for k in range(1, count + 1):
            share = k / count
            sway = 0.02 * float(rng.normal())
            poses.append(Pose2D(x + share * (to_x - x), y + share * (to_y - y), heading + sway))
    return poses


def _measured(moved: Pose2D, scale: float, rng: np.random.Generator) -> Pose2D:
    """Return a motion as wheels measure it."""
    turn = moved.heading * scale + DRIFT * float(rng.normal())
    along = moved.x * scale
    if rng.random() < SLIP_SHARE:
        along += SLIP[0] * float(rng.uniform())
        turn += SLIP[1] * float(rng.uniform(-1.0, 1.0))
    return Pose2D(along, moved.y * scale, turn)


def cast(plan: Building, pose: Pose2D) -> FloatArray:
    """Return the ranges (BEAMS,) of a scan; inf without a wall in range."""
    walls, glass = _near(plan, pose)
    angles = pose.heading - 0.5 * VIEW + VIEW / (BEAMS - 1) * np.arange(BEAMS)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    start, along = walls[:, :2] - (pose.x, pose.y), walls[:, 2:] - walls[:, :2]
    cross = directions[:, :1] * along[:, 1] - directions[:, 1:] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0]) / cross
        u = (start[:, 0] * directions[:, 1:] - start[:, 1] * directions[:, :1]) / cross
        hit = (t > 0.0) & (u >= -1e-9) & (u <= 1.0 + 1e-9)
        lengths = np.hypot(along[:, 0], along[:, 1])
        hit &= ~glass | (np.abs(cross) / lengths >= np.cos(REFLECTION))
    ranges: FloatArray = np.where(hit, t, np.inf).min(axis=1, initial=np.inf)
    return ranges


def _near(plan: Building, pose: Pose2D) -> tuple[FloatArray, FloatArray]:
    """Return the walls within the range of the lidar: they are parallel to the axes."""
    walls, reach = plan.walls, LONGEST + 1.0
    near = (
        (np.minimum(walls[:, 0], walls[:, 2]) < pose.x + reach)
        & (np.maximum(walls[:, 0], walls[:, 2]) > pose.x - reach)
        & (np.minimum(walls[:, 1], walls[:, 3]) < pose.y + reach)
        & (np.maximum(walls[:, 1], walls[:, 3]) > pose.y - reach)
    )
    return walls[near], plan.glass[near]
