"""What a run costs, and what a setting costs over its seeds, compared with the mission as it is.

The cost of a run that succeeds is a weighted mean of ratios to the baseline,

    cost = Σ w_m r_m / Σ w_m + w_c · collisions,   r_m = x_m / x_m(baseline)

(a clearance inversely), so that 1 is as good as the mission is now and 0.9 a tenth better. Ratios
end at WORST_RATIO and a cost at WORST_SUCCESS; a run that fails costs FAILED, more than any that
succeeds. Nothing counts as better below what a measure's floor says, so that nobody is rewarded for
the noise of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import mean, stdev

from missions.bench.mission_runs import MissionRun
from stack.errors import InputError
from stack.parameters import suggestion

FAILED = 10.0
WORST_SUCCESS, WORST_RATIO = 9.0, 5.0

COLLISIONS = "collisions"

STUDENT = (12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31, 2.26)
"""So many standard errors a mean of 2, 3… 10 differences may lie from 0 by chance in 95 % of cases
(Student's t, two-sided); of more: 2.2, a little too strict."""


@dataclass(frozen=True, slots=True)
class Measure:
    """One figure of a run.

    Attributes:
        name: as `--weight` takes it; the run's attribute of that name has the value.
        unit: of it.
        weight: unless another one is given.
        floor: below this nothing is gained.
        more_is_better: as with the clearance alone.
        help: what it is.
    """

    name: str
    unit: str
    weight: float
    floor: float
    help: str
    more_is_better: bool = False

    def of(self, run: MissionRun) -> float | None:
        """The value in a run; None where it has none."""
        value: float | None = getattr(run, self.name)
        return value

    def ratio(self, value: float, reference: float) -> float:
        """1 is as good as the reference, 2 twice as bad."""
        value, reference = max(value, self.floor), max(reference, self.floor)
        ratio = reference / value if self.more_is_better else value / reference
        return min(ratio, WORST_RATIO)


MEASURES = (
    Measure("time", "s", 1.0, 1.0, "simulated time of the mission"),
    Measure("detour", "", 0.5, 1.0, "way driven / shortest way by the goals"),
    Measure("clearance", "m", 0.5, 0.02, "least true distance to anything", more_is_better=True),
    Measure("turning", "rad/s²", 0.5, 0.02, "mean change of the commanded angular velocity"),
    Measure("jerk", "m/s³", 0.25, 0.05, "root mean square of the commanded jerk"),
    Measure("goal_error", "m", 0.5, 0.02, "true distance from the goals where it stops"),
    Measure(COLLISIONS, "", 1.0, 0.0, "contacts of the moving robot: each adds its weight"),
)

RELATIVE = tuple(measure for measure in MEASURES if measure.name != COLLISIONS)

Weights = Mapping[str, float]
Means = dict[str, float]


def read_weights(given: Mapping[str, str]) -> Weights:
    """All weights, with those of the command line over the usual ones.

    Raises:
        InputError: no such measure, or not a number from 0.
    """
    weights = {measure.name: measure.weight for measure in MEASURES}
    for name, text in given.items():
        if name not in weights:
            raise InputError(f"--weight {name}: no such measure; {suggestion(name, weights)}")
        try:
            weights[name] = float(text)
        except ValueError:
            weights[name] = -1.0
        if not 0.0 <= weights[name] <= 1e6:
            raise InputError(f"--weight {name}={text}: expected a number from 0, such as 0.5")
    if not any(weights[measure.name] for measure in RELATIVE):
        raise InputError("--weight: every measure has weight 0; leave one above it")
    return weights


def means_of(runs: Sequence[MissionRun]) -> Means:
    """The mean of each measure over the runs that have it."""
    values = {measure.name: [measure.of(run) for run in runs] for measure in MEASURES}
    known = {name: [v for v in found if v is not None] for name, found in values.items()}
    return {name: mean(found) for name, found in known.items() if found}


def cost_of(run: MissionRun, reference: Means, weights: Weights) -> float:
    """The cost of a run.

    Args:
        run: the run.
        reference: the means of the baseline's successes; what is not there does not count.
        weights: all of them.
    """
    if not run.success:
        return FAILED
    ratios = {
        measure.name: measure.ratio(value, reference[measure.name])
        for measure in RELATIVE
        if measure.name in reference and (value := measure.of(run)) is not None
    }
    total = sum(weights[name] for name in ratios)
    relative = (
        sum(weights[name] * ratio for name, ratio in ratios.items()) / total if total else 1.0
    )
    return min(relative + weights[COLLISIONS] * run.collisions, WORST_SUCCESS)


@dataclass(frozen=True, slots=True)
class Score:
    """What a setting came to.

    Attributes:
        settings: as text by name; empty for the baseline.
        costs: by seed.
        means: of each measure over its successful runs.
        gain: mean difference of the cost to the baseline's with the same seed; below 0 is better.
        noise: standard error of that mean; None with a single seed.
        successes: of so many runs as there are costs.
    """

    settings: Mapping[str, str]
    costs: Mapping[int, float]
    means: Means
    gain: float
    noise: float | None
    successes: int

    @property
    def cost(self) -> float:
        """Mean over the seeds."""
        return mean(self.costs.values())

    @property
    def worst(self) -> float:
        """Of its seeds."""
        return max(self.costs.values())

    @property
    def verdict(self) -> str:
        """Whether the difference to the baseline is more than the noise of the seeds (95 %)."""
        if self.noise is None:
            return "one seed"
        degrees = len(self.costs) - 1
        certain = STUDENT[degrees - 1] if degrees <= len(STUDENT) else 2.2
        if abs(self.gain) <= certain * self.noise:
            return "within noise"
        return "better" if self.gain < 0.0 else "worse"


Tried = Sequence[tuple[Mapping[str, str], Sequence[MissionRun]]]
"""Settings with their runs, the baseline first."""


def scores_of(tried: Tried, weights: Weights) -> list[Score]:
    """Scores in the same order: the baseline's first.

    The reference is the baseline's mean over its successful runs; where it never succeeds, that of
    everything that does.
    """
    baseline = tried[0][1]
    good = [run for run in baseline if run.success] or [
        run for _, runs in tried for run in runs if run.success
    ]
    reference = means_of(good)
    before = {run.seed: cost_of(run, reference, weights) for run in baseline}
    return [_score(settings, runs, before, (reference, weights)) for settings, runs in tried]


def _score(
    settings: Mapping[str, str],
    runs: Sequence[MissionRun],
    before: Mapping[int, float],
    by: tuple[Means, Weights],
) -> Score:
    costs = {run.seed: cost_of(run, *by) for run in runs}
    differences = [cost - before[seed] for seed, cost in costs.items()]
    several = len(differences) > 1
    good = [run for run in runs if run.success]
    return Score(
        settings, costs, means_of(good), mean(differences),
        stdev(differences) / sqrt(len(differences)) if several else None, len(good),
    )  # fmt: skip


def best_first(scores: Sequence[Score]) -> list[Score]:
    """By mean cost, then by the worst seed's; ties in the order in which they were tried."""
    return sorted(scores, key=lambda score: (round(score.cost, 9), score.worst))
