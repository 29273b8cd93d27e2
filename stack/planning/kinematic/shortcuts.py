"""Analytic expansions: direct connections of a pose to the goal, without a collision check."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, ceil, hypot
from typing import Any

import numpy as np

from stack.planning.kinematic.moves import Penalties, turned
from stack.planning.kinematic.search import PoseDrive
from stack.types import FloatArray, wrap_angle


@dataclass(frozen=True)
class CurveShortcut:
    """Shortest Dubins or Reeds-Shepp curve.

    Attributes:
        both_ways: use Reeds-Shepp curves.
        radius: turning radius, metres.
        penalties: cost penalties.
    """

    both_ways: bool
    radius: float
    penalties: Penalties

    def __call__(self, start: FloatArray, goal: FloatArray, spacing: float) -> PoseDrive:
        """Return the poses from start to goal, without the start, with the cost on free ground."""
        from stack.planning.curves import kernels

        shortest: Any = kernels.curve
        sample: Any = kernels.sample
        x, y = (goal[:2] - start[:2]) / self.radius
        c, s = np.cos(start[2]), np.sin(start[2])
        letters, lengths = shortest(
            self.both_ways, c * x + s * y, c * y - s * x, goal[2] - start[2]
        )
        poses, directions = sample(*start, letters, lengths, self.radius, spacing)
        cost, before = 0.0, None
        for letter, length in zip(letters.tolist(), lengths.tolist(), strict=True):
            if length == 0.0:
                continue
            kind = letter if length > 0.0 else letter + 3
            cost += self.penalties.of(abs(length) * self.radius, kind)
            if before is not None and (before[1] * length < 0.0 or before[0] * letter < 0):
                cost += self.penalties.change
            before = letter, length
        if len(poses):
            poses[-1] = goal
        return PoseDrive(poses, directions, cost)


@dataclass(frozen=True)
class TurnDriveTurn:
    """Turn towards the goal, drive straight to it, turn to its heading.

    Attributes:
        penalties: cost penalties.
    """

    penalties: Penalties

    def __call__(self, start: FloatArray, goal: FloatArray, spacing: float) -> PoseDrive:
        """Return the poses from start to goal, without the start, with the cost on free ground."""
        length = hypot(goal[0] - start[0], goal[1] - start[1])
        bearing = atan2(goal[1] - start[1], goal[0] - start[0]) if length > 1e-9 else start[2]
        first, last = wrap_angle(bearing - start[2]), wrap_angle(goal[2] - bearing)
        share = np.linspace(0.0, 1.0, ceil(length / spacing) + 1)[1:, None]
        driven = np.column_stack(
            [start[:2] + share * (goal[:2] - start[:2]), np.full(len(share), bearing)]
        )
        if length <= 1e-9:
            driven = np.empty((0, 3))
        turns = turned(start, first), turned(np.array([goal[0], goal[1], bearing]), last)
        directions = np.concatenate(
            [np.zeros(len(turns[0])), np.ones(len(driven)), np.zeros(len(turns[1]))]
        )
        cost = length + self.penalties.rotation * (abs(first) + abs(last))
        poses = np.vstack([turns[0], driven, turns[1]])
        if len(poses):
            poses[-1] = goal
        return PoseDrive(poses, directions.astype(np.int64), cost)
