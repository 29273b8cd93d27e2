"""Statistics of sweeps: rates, their differences, and claims that are tested after every run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import comb, erfc, lgamma, log, log1p, sqrt

import numpy as np

from missions.bench.bench import wilson
from stack.streams import stream
from stack.types import FloatArray

PERMUTATIONS = 500

BINS = 5
"""Groups of equally many runs into which the values of a distribution are sorted."""

PRIOR = 0.5
"""Both parameters of the beta distribution of the mixture (Jeffreys)."""


def newcombe(one: tuple[int, int], other: tuple[int, int]) -> tuple[float, float]:
    """Return the 95 % confidence interval of the difference of two independent rates, one - other.

    R. G. Newcombe, "Interval estimation for the difference between independent proportions",
    Statistics in Medicine 17, 1998: the hybrid score interval without correction (method 10).

    Args:
        one: successes and trials, at least one.
        other: as `one`.
    """
    first, second = one[0] / one[1], other[0] / other[1]
    (low1, high1), (low2, high2) = wilson(*one), wilson(*other)
    below = sqrt((first - low1) ** 2 + (high2 - second) ** 2)
    above = sqrt((high1 - first) ** 2 + (second - low2) ** 2)
    return first - second - below, first - second + above


def mcnemar(only_one: int, only_other: int) -> float:
    """Return the exact two-sided p-value of equal rates in paired runs.

    Q. McNemar, "Note on the sampling error of the difference between correlated proportions or
    percentages", Psychometrika 12, 1947; here by the binomial distribution.

    Args:
        only_one: pairs in which only the one succeeded.
        only_other: pairs in which only the other one did.
    """
    count = only_one + only_other
    tail = sum(comb(count, number) for number in range(min(only_one, only_other) + 1))
    return min(1.0, float(Fraction(2 * tail, 2**count)))


def mann_whitney(one: Sequence[float], other: Sequence[float]) -> tuple[float, float]:
    """Return the probability that a value of the one is larger, ties by half, and the p-value.

    H. B. Mann and D. R. Whitney, "On a test of whether one of two random variables is
    stochastically larger than the other", Annals of Mathematical Statistics 18, 1947. Two-sided, by
    the normal approximation with corrections for ties and continuity, which holds from about 8
    values each.
    """
    values = np.concatenate([one, other])
    ranks = _ranks(values)
    n, m = len(one), len(other)
    larger = float(ranks[:n].sum()) - n * (n + 1) / 2.0
    _, ties = np.unique(values, return_counts=True)
    total = n + m
    tied = float((ties**3 - ties).sum()) / (total * (total - 1)) if total > 1 else 0.0
    deviation = sqrt(max(0.0, n * m / 12.0 * (total + 1 - tied)))
    if deviation == 0.0:
        return larger / (n * m), 1.0
    z = max(0.0, abs(larger - n * m / 2.0) - 0.5) / deviation
    return larger / (n * m), erfc(z / sqrt(2.0))


def wilcoxon(differences: Sequence[float]) -> float:
    """Return the p-value of differences of pairs that are symmetric about zero.

    F. Wilcoxon, "Individual comparisons by ranking methods", Biometrics Bulletin 1, 1945: the
    signed-rank test without the zeros. Two-sided, by the normal approximation with corrections for
    ties and continuity, which holds from about 8 differences.
    """
    values = np.array([value for value in differences if value != 0.0], dtype=np.float64)
    n = len(values)
    if n == 0:
        return 1.0
    ranks = _ranks(np.abs(values))
    positive = float(ranks[values > 0.0].sum())
    deviation = sqrt(float((ranks**2).sum()) / 4.0)  # with the ties: their mean ranks
    z = max(0.0, abs(positive - n * (n + 1) / 4.0) - 0.5) / deviation
    return erfc(z / sqrt(2.0))


def _ranks(values: FloatArray) -> FloatArray:
    """Return the ranks of values from 1, the mean rank for equal ones."""
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    means: FloatArray = ends - (counts - 1) / 2.0
    return means[inverse]


def is_proved(successes: int, trials: int, rate: float, error: float) -> bool | None:
    """Whether the true rate is above `rate`: True, False, or None if it is not yet certain.

    It may be asked after every run: the probability that the answer is ever wrong is at most
    `error`. The likelihood of the runs, mixed over all rates by a beta distribution, divided by
    that at the true rate, is a martingale of mean 1, which ever exceeds 1 / error with at most that
    probability (Ville's inequality). The rates at which it does not are the confidence sequence.

    H. Robbins, "Statistical methods related to the law of the iterated logarithm", Annals of
    Mathematical Statistics 41, 1970.

    Args:
        successes: so far.
        trials: so far.
        rate: in (0, 1).
        error: in (0, 1), such as 0.05.
    """
    failures = trials - successes
    mixed = _log_beta(PRIOR + successes, PRIOR + failures) - _log_beta(PRIOR, PRIOR)
    at_rate = successes * log(rate) + failures * log1p(-rate)
    if trials == 0 or mixed - at_rate < -log(error):
        return None
    return successes / trials > rate


def _log_beta(a: float, b: float) -> float:
    return lgamma(a) + lgamma(b) - lgamma(a + b)


@dataclass(frozen=True, slots=True)
class Sensitivity:
    """How much a figure depends on a factor.

    Attributes:
        factor: its name.
        share: of the variance of the figure that the values of the factor explain, in [0, 1], less
            the share that chance explains on average.
        p_value: share of the permutations that explain as much.
    """

    factor: str
    share: float
    p_value: float


def groups_of(values: Sequence[float | str]) -> list[int]:
    """Return the group of each run by its value of a factor.

    Each value is a group. Of more numbers than BINS, that many groups have equally many runs.
    """
    numbers_only = not any(isinstance(value, str) for value in values)
    known = sorted(set(values)) if numbers_only else list(dict.fromkeys(values))
    if len(known) <= BINS or not numbers_only:
        return [known.index(value) for value in values]
    numbers = np.array(values, dtype=np.float64)
    edges = np.quantile(numbers, np.linspace(0.0, 1.0, BINS + 1)[1:-1])
    return [int(group) for group in np.searchsorted(edges, numbers, side="right")]


def sensitivities(
    factors: Mapping[str, Sequence[float | str]], figure: Sequence[float], seed: int = 0
) -> list[Sensitivity]:
    """Return how much of the variance of a figure each factor explains alone, the most first.

    The share is the correlation ratio: variance of the group means over that of all values. Random
    groups explain a share too; the mean over permutations is that, and is subtracted.

    Args:
        factors: the value of each run by the name of the factor.
        figure: of each run.
        seed: of the permutations.
    """
    values = np.array(figure, dtype=np.float64)
    found = []
    for name, of_runs in factors.items():
        groups = np.array(groups_of(of_runs))
        share = _explained(groups, values)
        generator = stream(seed, f"sensitivity {name}")
        chance = np.array([
            _explained(groups, generator.permutation(values)) for _ in range(PERMUTATIONS)
        ])  # fmt: skip
        p_value = (1 + int((chance >= share - 1e-12).sum())) / (1 + PERMUTATIONS)
        found.append(Sensitivity(name, max(0.0, share - float(chance.mean())), p_value))
    return sorted(found, key=lambda one: -one.share)


def _explained(groups: FloatArray, values: FloatArray) -> float:
    """Return the share of the variance that groups explain (n,), whole numbers from 0."""
    whole = float(((values - values.mean()) ** 2).sum())
    if whole <= 0.0:
        return 0.0
    counts = np.bincount(groups)
    sums = np.bincount(groups, weights=values)
    means = sums / np.maximum(counts, 1)
    return float((counts * (means - values.mean()) ** 2).sum()) / whole
