"""Settings compared with the baseline, seed by seed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import mean, stdev

from missions.sweeps.row import SweepRow
from missions.tuning.objectives import Means, Objective, means_of

STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26)
"""95 % quantile of Student's t, two-sided, for the mean of 2, 3… 10 differences. For more
differences 2.2 is used, which is slightly too strict."""


@dataclass(frozen=True, slots=True)
class Difference:
    """An objective's difference to the baseline with the same seeds.

    Attributes:
        gain: mean.
        noise: standard error; None with a single seed.
        seeds: number of them.
        sign: of the objective; with it, a gain below 0 is better.
    """

    gain: float
    noise: float | None
    seeds: int
    sign: float

    @property
    def verdict(self) -> str:
        """Statistical significance of the gain at 95 %: better, worse, within noise or one seed."""
        if self.noise is None:
            return "one seed"
        degrees = self.seeds - 1
        certain = STUDENT[degrees - 1] if degrees <= len(STUDENT) else 2.2
        if abs(self.gain) <= certain * self.noise:
            return "within noise"
        return "better" if self.sign * self.gain < 0.0 else "worse"


@dataclass(frozen=True, slots=True)
class Score:
    """Score of a setting over its seeds.

    Attributes:
        settings: name -> value as text; empty for the baseline.
        values: of each objective: seed -> value.
        differences: of each objective to the baseline.
        means: mean of each measure over the successful runs.
        successes: number of successful runs.
        is_pruned: whether its remaining seeds were left out.
    """

    settings: Mapping[str, str]
    values: Sequence[Mapping[int, float]]
    differences: Sequence[Difference]
    means: Means
    successes: int
    is_pruned: bool = False

    @property
    def seeds(self) -> int:
        """Number of runs."""
        return len(self.values[0])

    def mean(self, objective: int = 0) -> float:
        """Return the mean of an objective over the seeds."""
        return mean(self.values[objective].values())

    @property
    def rate(self) -> float:
        """Rate of success."""
        return self.successes / self.seeds


Tried = tuple[Mapping[str, str], Sequence[SweepRow]]
"""Settings with their runs."""


def score_of(
    tried: Tried, baseline: Sequence[SweepRow], objectives: Sequence[Objective], reference: Means,
    *, is_pruned: bool = False,
) -> Score:  # fmt: skip
    """Return the score of a setting.

    Args:
        tried: the setting with its runs.
        baseline: runs of the unchanged mission with the same seeds, and maybe further ones.
        objectives: what is better.
        reference: means of the baseline's successful runs.
        is_pruned: whether its remaining seeds were left out.
    """
    settings, runs = tried
    values = [{run.seed: one.value(run, reference) for run in runs} for one in objectives]
    differences = []
    for objective, own in zip(objectives, values, strict=True):
        before = {run.seed: objective.value(run, reference) for run in baseline}
        gains = [value - before[seed] for seed, value in own.items()]
        noise = stdev(gains) / sqrt(len(gains)) if len(gains) > 1 else None
        differences.append(Difference(mean(gains), noise, len(gains), objective.sign))
    good = [run for run in runs if run.is_success]
    return Score(settings, values, differences, means_of(good), len(good), is_pruned)


def best_first(scores: Sequence[Score], objectives: Sequence[Objective]) -> list[Score]:
    """Return scores by the first objective, then by its worst seed; pruned ones come last."""
    sign = objectives[0].sign

    def key(score: Score) -> tuple[bool, float, float]:
        worst = max(sign * value for value in score.values[0].values())
        return score.is_pruned, round(sign * score.mean(), 9), worst

    return sorted(scores, key=key)


def front_of(scores: Sequence[Score], objectives: Sequence[Objective]) -> list[Score]:
    """Return the settings that no other one beats in every objective, by the first objective.

    Settings that were pruned, or succeed less often than the baseline, are left out.

    Args:
        scores: the baseline first.
        objectives: of the scores.
    """
    able = [one for one in scores if not one.is_pruned and one.rate >= scores[0].rate]
    points = [tuple(one.sign * score.mean(n) for n, one in enumerate(objectives)) for score in able]
    front = [
        score for score, point in zip(able, points, strict=True)
        if not any(
            other != point and all(a <= b for a, b in zip(other, point, strict=True))
            for other in points
        )
    ]  # fmt: skip
    return best_first(front, objectives)
