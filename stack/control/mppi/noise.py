"""Precomputed table of noise: a draw is an offset into it instead of 100 000 normal samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.streams import stream

Array32 = NDArray[np.float32]

TABLE_LENGTH = 4
"""Number of columns of the table, in batches."""

CALM_SHARE, CALMEST = 0.4, 0.03
"""Share of the rollouts with reduced noise, and the smallest factor on it."""


class NoiseTable:
    """Normal noise, correlated over the steps of a rollout.

    Each column is the noise of one rollout and one axis, a stationary first-order autoregressive
    sequence. A command uses `batch` neighbouring columns from a random offset, a different one per
    axis, so that the combinations are new although the columns repeat.

    Attributes:
        values: (axes, steps, columns) float32.
        scales: (batch,) float32 factors on a draw: rollouts with little noise keep to a plan
            through a narrow passage, where those with full noise all collide.
    """

    def __init__(self, batch: int, steps: int, correlation: float, deviations: list[float]) -> None:
        """Draw the table.

        Args:
            batch: rollouts per command.
            steps: steps per rollout.
            correlation: of neighbouring steps, in [0, 1).
            deviations: standard deviation per axis, m/s or rad/s.
        """
        self._correlation, self._deviations = correlation, np.array(deviations)
        self._random = stream(0, "mppi noise")
        shape = (len(deviations), steps, TABLE_LENGTH * batch)
        self.values: Array32 = self._random.standard_normal(shape, dtype=np.float32)
        fresh = np.float32(np.sqrt(1.0 - correlation * correlation))
        for t in range(1, steps):
            self.values[:, t] *= fresh
            self.values[:, t] += np.float32(correlation) * self.values[:, t - 1]
        self.values *= np.array(deviations, np.float32)[:, None, None]
        self._last = shape[2] - batch
        calm = np.geomspace(CALMEST, 1.0, round(CALM_SHARE * batch))
        self.scales: Array32 = np.ones(batch, np.float32)
        self.scales[: len(calm)] = calm

    def begins(self) -> NDArray[np.int64]:
        """Return the (axes,) first columns of the next draw."""
        return self._random.integers(0, self._last + 1, len(self.values))

    def pull(self, plan: Array32) -> Array32:
        """Return the plan times the inverse covariance of the noise; both (axes, steps).

        The inverse covariance of a first-order autoregressive sequence is tridiagonal.
        """
        r = self._correlation
        middle = plan.astype(np.float64)
        weighed = (1.0 + r * r) * middle
        weighed[:, 0] -= r * r * middle[:, 0]
        weighed[:, -1] -= r * r * middle[:, -1]
        weighed[:, 1:] -= r * middle[:, :-1]
        weighed[:, :-1] -= r * middle[:, 1:]
        weighed /= (1.0 - r * r) * np.square(self._deviations)[:, None]
        return weighed.astype(np.float32)
