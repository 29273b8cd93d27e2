"""What a tuning improves: measures of runs, their weighted cost, and objectives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from statistics import mean

from missions.sweeps.row import SweepRow
from stack.errors import InputError
from stack.parameters import suggestion

FAILED = 10.0
WORST_SUCCESS, WORST_RATIO = 9.0, 5.0

NOTHING_KNOWN = 1e6
"""Value of a failed run as long as no run has succeeded; 1 / this if more is better."""

COST, COLLISIONS, SUCCESS = "cost", "collisions", "success"


@dataclass(frozen=True, slots=True)
class Measure:
    """One figure of a run.

    Attributes:
        name: for `--weight`, `--minimise` and `--maximise`.
        unit: of the value.
        weight: default weight.
        floor: smaller values count as this value.
        help: one-line description.
        read: returns the value of a run; None if it has none.
        more_is_better: whether a larger value is better.
    """

    name: str
    unit: str
    weight: float
    floor: float
    help: str
    read: Callable[[SweepRow], float | None]
    more_is_better: bool = False

    def ratio(self, value: float, reference: float) -> float:
        """Return 1 for a value as good as the reference, 2 for one twice as bad."""
        value, reference = max(value, self.floor), max(reference, self.floor)
        ratio = reference / value if self.more_is_better else value / reference
        return min(ratio, WORST_RATIO)


def _clearance(row: SweepRow) -> float | None:
    return 1.0 if row.clearance is None and row.seconds is not None else row.clearance


MEASURES = (
    Measure("time", "s", 1.0, 1.0, "simulated time of the mission", lambda row: row.seconds),
    Measure("detour", "", 0.5, 1.0, "driven distance / shortest path over the goals",
            lambda row: row.detour),
    Measure("clearance", "m", 0.5, 0.02, "smallest true distance to obstacles", _clearance,
            more_is_better=True),
    Measure("turning", "rad/s²", 0.5, 0.02, "mean change of the commanded angular velocity",
            lambda row: row.turning),
    Measure("jerk", "m/s³", 0.25, 0.05, "root mean square of the commanded jerk",
            lambda row: row.jerk),
    Measure("goal_error", "m", 0.5, 0.02, "true distance to the reached goals",
            lambda row: row.goal_error),
    Measure(COLLISIONS, "", 1.0, 0.0, "contacts of the moving robot; each adds the weight",
            lambda row: row.collisions),
)  # fmt: skip
BY_NAME = {measure.name: measure for measure in MEASURES}

RELATIVE = tuple(measure for measure in MEASURES if measure.name != COLLISIONS)

Weights = Mapping[str, float]
Means = Mapping[str, float]


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


def means_of(runs: Sequence[SweepRow]) -> Means:
    """Return the mean of each measure over the runs that have it."""
    values = {measure.name: [measure.read(run) for run in runs] for measure in MEASURES}
    known = {name: [v for v in found if v is not None] for name, found in values.items()}
    return {name: mean(found) for name, found in known.items() if found}


def cost_of(run: SweepRow, reference: Means, weights: Weights) -> float:
    """Return the cost of a run.

    Args:
        run: the run.
        reference: means of the baseline's successful runs; measures without a mean do not count.
        weights: weight of every measure.
    """
    if not run.is_success:
        return FAILED
    ratios = {
        measure.name: measure.ratio(value, reference[measure.name])
        for measure in RELATIVE
        if measure.name in reference and (value := measure.read(run)) is not None
    }
    total = sum(weights[name] for name in ratios)
    relative = (
        sum(weights[name] * ratio for name, ratio in ratios.items()) / total if total else 1.0
    )
    return min(relative + weights[COLLISIONS] * (run.collisions or 0), WORST_SUCCESS)


@dataclass(frozen=True)
class Objective:
    """What is minimised or maximised: the mean of its values over the seeds.

    Attributes:
        name: of a measure; COST or SUCCESS.
        maximises: whether more is better.
        weights: of the measures in the cost.
    """

    name: str
    maximises: bool
    weights: Weights

    @property
    def unit(self) -> str:
        """Unit of the values."""
        return BY_NAME[self.name].unit if self.name in BY_NAME else ""

    @property
    def sign(self) -> float:
        """Factor of the values with which less is better."""
        return -1.0 if self.maximises else 1.0

    def value(self, run: SweepRow, reference: Means) -> float:
        """Return the value of a run.

        That of a failed one is WORST_RATIO times as bad as the reference.
        """
        if self.name == COST:
            return cost_of(run, reference, self.weights)
        if self.name == SUCCESS:
            return float(run.is_success)
        measure = BY_NAME[self.name]
        value = measure.read(run)
        if run.is_success and value is not None:
            return value
        if self.name not in reference:
            return 1.0 / NOTHING_KNOWN if self.maximises else NOTHING_KNOWN
        usual = max(reference[self.name], measure.floor)
        return usual / WORST_RATIO if self.maximises else usual * WORST_RATIO


def read_objectives(
    minimised: Sequence[str], maximised: Sequence[str], weights: Weights
) -> tuple[Objective, ...]:
    """Return the objectives of the command line; the cost without any.

    Raises:
        InputError: an unknown name, or one that is given twice.
    """
    given = [*((name, False) for name in minimised), *((name, True) for name in maximised)]
    known = (COST, SUCCESS, *BY_NAME)
    for name, maximises in given:
        option = "--maximise" if maximises else "--minimise"
        if name not in known:
            raise InputError(f"{option} {name}: unknown measure; {suggestion(name, known)}")
        if [one for one, _ in given].count(name) > 1:
            raise InputError(f"{option} {name}: it is given twice")
    chosen = given or [(COST, False)]
    return tuple(Objective(name, maximises, weights) for name, maximises in chosen)
