"""A robot on a floor with painted lines, whose camera sees a piece of it ahead."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from math import cos, radians, sin, tan

import cv2
import numpy as np

from stack.types import FloatArray, FloorLines, LineColour, Pose2D
from tests.behaviours.kinematic_robot import KinematicRobot

CELL = 0.01
WIDTH = 0.05
NEAREST, FARTHEST, HALF_VIEW = 0.8, 1.8, radians(35.0)
PICTURE_STEPS, LATENCY_STEPS = 4, 2
MIDDLE, AROUND = 900, 200
"""Cells from the edge of the floor to the origin, and around the robot of what it knows."""


def painted(*lines: FloatArray, size: float = 5.0, seen: float | None = None) -> FloorLines:
    """Lines (n, 2) on a floor of `size` metres around the origin, seen up to an x."""
    count = round(size / CELL)
    middles = CELL * (np.arange(count) + 0.5) - size / 2.0
    x, y = np.meshgrid(middles, middles)
    away = distances(np.column_stack([x.ravel(), y.ravel()]), lines).reshape(x.shape)
    shown = np.ones_like(x, dtype=bool) if seen is None else x < seen
    return FloorLines(1.0, (away <= WIDTH / 2) & shown, shown, (-size / 2, -size / 2), CELL)


def distances(points: FloatArray, lines: tuple[FloatArray, ...]) -> FloatArray:
    """(n,) metres from points to the nearest line."""
    nearest = np.full(len(points), np.inf)
    for line in lines:
        for start, end in pairwise(line):
            edge = end - start
            share = np.clip(((points - start) @ edge) / (edge @ edge), 0.0, 1.0)
            away = np.linalg.norm(points - start - share[:, None] * edge, axis=1)
            nearest = np.minimum(nearest, away)
    return nearest


@dataclass
class LineRobot(KinematicRobot):
    """Sees the floor from 0.8 to 1.8 m ahead at 5 Hz, 0.1 s late.

    Attributes:
        floor: the lines, each (n, 2), within 6 m of the origin.
        camera_works: whether pictures arrive.
    """

    floor: tuple[FloatArray, ...] = ()
    camera_works: bool = True
    known: FloorLines | None = None
    exposed: list[tuple[int, Pose2D]] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        paint = np.zeros((2 * MIDDLE, 2 * MIDDLE), np.uint8)
        for line in self.floor:
            fine = np.rint(16.0 * (line / CELL + MIDDLE - 0.5)).astype(np.int32)
            cv2.polylines(paint, [fine.reshape(-1, 1, 2)], False, 1, round(WIDTH / CELL), shift=4)
        self._paint, self._shown = paint > 0, np.zeros_like(paint, dtype=bool)

    def wear(self, share: float, side: float, seed: int) -> None:
        """Take a share of the paint off, in squares of `side` metres."""
        count = round(side / CELL)
        squares = np.random.default_rng(seed).random(np.array(self._paint.shape) // count)
        self._paint &= ~np.kron(squares < share, np.ones((count, count), dtype=bool))

    def floor_lines(self, colour: LineColour, width: float) -> FloorLines | None:
        return self.known

    def _scan(self) -> None:
        """It has no lidar."""

    def _step(self) -> None:
        super()._step()
        if self.camera_works and self.steps % PICTURE_STEPS == 0:
            self.exposed.append((self.steps, self.odometry))
        if self.exposed and self.exposed[0][0] <= self.steps - LATENCY_STEPS:
            step, pose = self.exposed.pop(0)
            self._see(step * 0.05, pose)

    def _see(self, stamp: float, pose: Pose2D) -> None:
        """Show the cells in view, and give the behaviour the 4 m around the robot."""
        column, row = (round(value / CELL) + MIDDLE - AROUND for value in (pose.x, pose.y))
        part = np.s_[row : row + 2 * AROUND, column : column + 2 * AROUND]
        corner = (CELL * (column - MIDDLE), CELL * (row - MIDDLE))
        middles = CELL * (np.arange(2 * AROUND) + 0.5)
        x, y = middles + corner[0] - pose.x, (middles + corner[1] - pose.y)[:, None]
        ahead = x * cos(pose.heading) + y * sin(pose.heading)
        aside = y * cos(pose.heading) - x * sin(pose.heading)
        far = x * x + y * y < FARTHEST**2
        self._shown[part] |= far & (ahead > NEAREST) & (np.abs(aside) < ahead * tan(HALF_VIEW))
        seen = self._shown[part].copy()
        self.known = FloorLines(stamp, self._paint[part] & seen, seen, corner, CELL)
