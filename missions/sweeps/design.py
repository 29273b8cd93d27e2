"""Design of a sweep: which run has which seed and settings.

A run is a pure function of the sweep and its number: an interrupted sweep has the same runs
when it is continued, on any machine.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, log2, prod

import numpy as np

from missions.sweeps.factors import Factor
from stack.optional_packages import SCIPY
from stack.streams import stream
from stack.types import FloatArray

GRID, RANDOM, LATIN, SOBOL = "grid", "random", "latin", "sobol"
DESIGNS = (GRID, RANDOM, LATIN, SOBOL)

BY_SCIPY = (LATIN, SOBOL)
"""Designs that SciPy's `stats.qmc` makes."""

Settings = tuple[tuple[str, str], ...]
"""Name and value, as text, of each factor."""


@dataclass(frozen=True, slots=True)
class RunDescription:
    """A run to make.

    Attributes:
        number: in the sweep, from 0.
        seed: of the run.
        settings: values of the factors.
    """

    number: int
    seed: int
    settings: Settings = ()


@dataclass(frozen=True)
class Design:
    """Settings of all runs.

    A grid goes through all combinations with the first seed, then again with the next one: every
    combination meets the same seeds. The other designs give each run a seed of its own.

    Attributes:
        kind: grid | random | latin | sobol.
        factors: what varies.
        seed: of the first run, and of the draws.
        runs: number of runs; only a Latin hypercube depends on it.
    """

    kind: str
    factors: tuple[Factor, ...]
    seed: int
    runs: int

    @property
    def combinations(self) -> int:
        """Number of combinations of a grid."""
        return prod(len(factor.values) for factor in self.factors)

    def run(self, number: int) -> RunDescription:
        """Return a run."""
        if self.kind == GRID:
            turn, at = divmod(number, self.combinations)
            return RunDescription(number, self.seed + turn, self._combination(at))
        shares = self._shares(number)
        settings = tuple(
            (factor.name, factor.at(float(share)))
            for factor, share in zip(self.factors, shares, strict=True)
        )
        return RunDescription(number, self.seed + number, settings)

    def _combination(self, at: int) -> Settings:
        """Return a combination; the last factor varies fastest."""
        found: list[tuple[str, str]] = []
        for factor in reversed(self.factors):
            at, which = divmod(at, len(factor.values))
            found.append((factor.name, factor.values[which]))
        return tuple(reversed(found))

    def _shares(self, number: int) -> Sequence[float] | FloatArray:
        """Return the shares in [0, 1) at which the factors of a run are drawn."""
        if not self.factors:
            return ()
        if self.kind == RANDOM:
            return stream(self.seed, "sweep", number).random(len(self.factors))
        row: FloatArray = _points(self.kind, self.runs, len(self.factors), self.seed)[number]
        return row


@lru_cache(maxsize=4)
def _points(kind: str, count: int, dimensions: int, seed: int) -> FloatArray:
    """Return the points (count, dimensions) of a design of SciPy, in [0, 1).

    Raises:
        InputError: SciPy is not installed.
    """
    SCIPY.require(f"the design {kind} needs")
    from scipy.stats import qmc

    generator = np.random.default_rng(stream(seed, "sweep").integers(2**32))
    if kind == LATIN:
        points: FloatArray = qmc.LatinHypercube(dimensions, rng=generator).random(count)
        return points
    # Sobol points are balanced in powers of two; further runs continue the sequence.
    points = qmc.Sobol(dimensions, rng=generator).random_base2(ceil(log2(max(count, 2))))
    return points[:count]


def default_design(factors: Sequence[Factor]) -> str:
    """Return the design when none is chosen: a grid of lists, else random."""
    return GRID if factors and all(factor.is_list for factor in factors) else RANDOM
