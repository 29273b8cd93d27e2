"""What people do who are stuck: they squeeze past close to walls, and in the end turn back a while.

Without it two bodies that meet where the repulsion of walls leaves them no room stand for ever.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from stack.types import FloatArray

STUCK_SHARE = 0.15
"""Share of the wanted speed, in the wanted direction, below which a person is stuck."""

MEAN_TIME = 1.0
"""Seconds over which that speed is averaged."""

SQUEEZE_AFTER, SQUEEZE_TIME = 0.8, 3.0
"""Seconds of being stuck after which a person goes close to walls, and for how long."""

SQUEEZE_WEIGHT = 0.1
"""Factor on the repulsion of walls meanwhile."""

BACK_AFTER = BACK_TIME = (3.0, 8.0)
"""Limits of the seconds of being stuck after which a person turns back, and of the way back."""


class Impatience:
    """Patience of n people who walk to goals.

    Attributes:
        turns_back: (n,) who walks back at the moment.
    """

    def __init__(self, count: int, random: Generator) -> None:
        self._random = random
        self._onward: FloatArray = np.zeros(count)
        self._stuck: FloatArray = np.zeros(count)
        self._squeeze_left: FloatArray = np.zeros(count)
        self._back_left: FloatArray = np.zeros(count)
        self._patience = self._drawn(BACK_AFTER, count)
        self.turns_back: NDArray[np.bool_] = np.zeros(count, dtype=np.bool_)

    @property
    def wall_weights(self) -> FloatArray:
        """(n,) factors on the repulsion of walls."""
        return np.where(self._squeeze_left > 0.0, SQUEEZE_WEIGHT, 1.0)

    def update(self, period: float, wanted: FloatArray, velocities: FloatArray) -> None:
        """Note how everyone has got on.

        Args:
            period: seconds since the last call.
            wanted: (n, 2) velocity that each would have if alone, m/s.
            velocities: (n, 2) m/s.
        """
        speeds = np.hypot(*wanted.T)
        onward = (wanted * velocities).sum(axis=1) / np.maximum(speeds, 1e-9)
        # A mean: people who press against each other move to and fro.
        self._onward += min(1.0, period / MEAN_TIME) * (onward - self._onward)
        stuck = (speeds > 0.0) & (self._onward < STUCK_SHARE * speeds)
        self._stuck = np.where(stuck, self._stuck + period, 0.0)
        self._squeeze_left = np.maximum(self._squeeze_left - period, 0.0)
        self._squeeze_left[self._stuck >= SQUEEZE_AFTER] = SQUEEZE_TIME
        self._back_left = np.maximum(self._back_left - period, 0.0)
        gives_up = self._stuck >= self._patience
        if gives_up.any():
            count: Any = int(gives_up.sum())
            self._back_left[gives_up] = self._drawn(BACK_TIME, count)
            self._patience[gives_up] = self._drawn(BACK_AFTER, count)
            self._stuck[gives_up] = 0.0
        self.turns_back = self._back_left > 0.0

    def _drawn(self, limits: tuple[float, float], count: int) -> FloatArray:
        drawn: FloatArray = self._random.uniform(*limits, count)
        return drawn
