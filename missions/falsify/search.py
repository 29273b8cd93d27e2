"""Search for the point of a unit cube with the least margin: first spread, then CMA-ES.

Failures are rare and often in a corner, where a local search from the middle finds no slope. So the
first points are spread over the cube, by a Latin hypercube; then CMA-ES (Hansen and Ostermeier
2001) starts from the best one, and again elsewhere once it has converged.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from stack.optional_packages import CMA
from stack.streams import stream
from stack.types import FloatArray

SPREAD_SHARE = 0.25
"""Share of the budget that is spread."""

LARGEST_STEP = 0.25
"""Largest initial deviation of CMA-ES, of the sides of the cube; otherwise the spread's spacing."""

SMALLEST_STEP = 0.002
"""Deviation below which CMA-ES has converged."""


class Search:
    """Proposes points in batches, and learns their margins.

    Args:
        dimensions: of the cube, at least 1.
        budget: number of points.
        seed: of the draws.

    Attributes:
        best: point with the least margin so far; None before the first batch.
        least: its margin.
    """

    def __init__(self, dimensions: int, budget: int, seed: int) -> None:
        CMA.require("falsify needs")
        self._dimensions, self._left = dimensions, budget
        self._random = stream(seed, "falsify")
        count = min(budget, max(4, round(SPREAD_SHARE * budget)))
        self._step = min(LARGEST_STEP, count ** (-1.0 / dimensions))
        self._spread = _latin(count, dimensions, self._random)
        self._strategy: Any = None
        self._asked: list[FloatArray] = []
        self._tried: list[tuple[float, FloatArray]] = []
        self.best: FloatArray | None = None
        self.least = inf

    def ask(self, batch: int) -> list[FloatArray]:
        """Return the next points, each (dimensions,) in [0, 1); none once the budget is spent.

        Args:
            batch: largest number of spread points; CMA-ES has its own number.
        """
        if len(self._spread):
            spread, self._spread = self._spread[:batch], self._spread[batch:]
            return self._propose(list(spread))
        if self._left <= 0:
            return []
        if self._strategy is None:
            self._strategy = self._started()
        self._asked = self._strategy.ask()
        points = [np.clip(point[: self._dimensions], 0.0, 1.0 - 1e-9) for point in self._asked]
        return self._propose(points[: self._left])

    def tell(self, points: Sequence[FloatArray], margins: Sequence[float]) -> None:
        """Learn the margins of the points that were asked last."""
        for point, margin in zip(points, margins, strict=True):
            self._tried.append((margin, point))
            if margin < self.least:
                self.best, self.least = point, margin
        if self._strategy is None or len(margins) < len(self._asked):
            return
        self._strategy.tell(self._asked, list(margins))
        is_flat = max(margins) == min(margins)
        if self._strategy.stop() or self._strategy.sigma < SMALLEST_STEP or is_flat:
            self._strategy = None

    def _propose(self, points: list[FloatArray]) -> list[FloatArray]:
        self._left -= len(points)
        return points

    def _started(self) -> Any:
        """Return CMA-ES at the best point that no start has used before, or a random one."""
        with catch_warnings():  # it tells on import that it cannot plot
            simplefilter("ignore")
            import cma

        begin = min(self._tried, key=lambda item: item[0])[1] if self._tried else None
        self._tried.clear()
        if begin is None:
            begin = self._random.random(self._dimensions)
        # CMA-ES needs two dimensions: of one, the second has no effect.
        at = np.clip(np.append(begin, 0.5) if self._dimensions == 1 else begin, 0.01, 0.99)
        options = {
            "bounds": [0.0, 1.0], "verbose": -9, "seed": np.nan, "maxiter": np.inf,
            "randn": lambda *shape: self._random.standard_normal(shape),
        }  # fmt: skip
        return cma.CMAEvolutionStrategy(at, self._step, options)


def _latin(count: int, dimensions: int, random: np.random.Generator) -> FloatArray:
    """Return points (count, dimensions), one in each of `count` equal parts of every side."""
    columns = [random.permutation(count) for _ in range(dimensions)]
    return (np.column_stack(columns) + random.random((count, dimensions))) / count
