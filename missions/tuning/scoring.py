"""Cost of a run, and score of a setting over its seeds, relative to the unchanged mission.

The cost of a successful run is a weighted mean of ratios to the baseline,

    cost = Σ w_m r_m / Σ w_m + w_c · collisions,   r_m = x_m / x_m(baseline)

(inverse for the clearance): 1 is as good as the unchanged mission, 0.9 a tenth better. Ratios are
limited to WORST_RATIO and costs to WORST_SUCCESS; a failed run costs FAILED, more than any
successful one. Values below a measure's floor count as the floor, so that noise is not rewarded.
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
"""95 % quantile of Student's t, two-sided, for the mean of 2, 3… 10 differences. For more
differences 2.2 is used, which is slightly too strict."""


@dataclass(frozen=True, slots=True)
class Measure:
    """One figure of a run.

    Attributes:
        name: name for `--weight`, and of the run's attribute with the value.
        unit: unit of the value.
        weight: default weight.
        floor: smaller values count as this value.
        help: one-line description.
        more_is_better: whether a larger value is better.
    """

    name: str
    unit: str
    weight: float
    floor: float
    help: str
    more_is_better: bool = False

    def of(self, run: MissionRun) -> float | None:
        """Return the value of a run; None if it has none."""
        value: float | None = getattr(run, self.name)
        return value

    def ratio(self, value: float, reference: float) -> float:
        """Return 1 for a value as good as the reference, 2 for one twice as bad."""
        value, reference = max(value, self.floor), max(reference, self.floor)
        ratio = reference / value if self.more_is_better else value / reference
        return min(ratio, WORST_RATIO)


MEASURES = (
    Measure("time", "s", 1.0, 1.0, "simulated time of the mission"),
    Measure("detour", "", 0.5, 1.0, "driven distance / shortest path over the goals"),
    Measure(
        "clearance", "m", 0.5, 0.02, "smallest true distance to obstacles", more_is_better=True
    ),
    Measure("turning", "rad/s²", 0.5, 0.02, "mean change of the commanded angular velocity"),
    Measure("jerk", "m/s³", 0.25, 0.05, "root mean square of the commanded jerk"),
    Measure("goal_error", "m", 0.5, 0.02, "true distance to the reached goals"),
    Measure(COLLISIONS, "", 1.0, 0.0, "contacts of the moving robot; each adds the weight"),
)

RELATIVE = tuple(measure for measure in MEASURES if measure.name != COLLISIONS)

Weights = Mapping[str, float]
Means = dict[str, float]


def read_weights(given: Mapping[str, str]) -> Weights:
    """Return all weights; those of the command line override the defaults.

    Raises:
        InputError: unknown measure, or the weight is not a number of at least 0.
    """
    weights = {measure.name: measure.weight for measure in MEASURES}
    for name, text in given.items():
        if name not in weights:
            raise InputError(f"--weight {name}: unknown measure; {suggestion(name, weights)}")
        try:
            weights[name] = float(text)
        except ValueError:
            weights[name] = -1.0
        if not 0.0 <= weights[name] <= 1e6:
            raise InputError(f"--weight {name}={text}: expected a number from 0 to 1e6, e.g. 0.5")
    if not any(weights[measure.name] for measure in RELATIVE):
        raise InputError("--weight: every measure has weight 0; set at least one above 0")
    return weights


def means_of(runs: Sequence[MissionRun]) -> Means:
    """Return the mean of each measure over the runs that have it."""
    values = {measure.name: [measure.of(run) for run in runs] for measure in MEASURES}
    known = {name: [v for v in found if v is not None] for name, found in values.items()}
    return {name: mean(found) for name, found in known.items() if found}


def cost_of(run: MissionRun, reference: Means, weights: Weights) -> float:
    """Return the cost of a run.

    Args:
        run: the run.
        reference: means of the baseline's successful runs; measures without a mean do not count.
        weights: weight of every measure.
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
    """Score of a setting over its seeds.

    Attributes:
        settings: name -> value as text; empty for the baseline.
        costs: seed -> cost.
        means: mean of each measure over the successful runs.
        gain: mean difference to the baseline's cost with the same seed; below 0 is better.
        noise: standard error of the gain; None with a single seed.
        successes: number of successful runs.
    """

    settings: Mapping[str, str]
    costs: Mapping[int, float]
    means: Means
    gain: float
    noise: float | None
    successes: int

    @property
    def cost(self) -> float:
        """Mean cost over the seeds."""
        return mean(self.costs.values())

    @property
    def worst(self) -> float:
        """Largest cost of a seed."""
        return max(self.costs.values())

    @property
    def verdict(self) -> str:
        """Statistical significance of the gain at 95 %: better, worse, within noise or one seed."""
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
    """Return the scores in the same order, the baseline first.

    The reference is the mean over the baseline's successful runs; if it has none, over all
    successful runs.
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
    """Return scores sorted by mean cost, then by the worst seed; the sort is stable."""
    return sorted(scores, key=lambda score: (round(score.cost, 9), score.worst))
