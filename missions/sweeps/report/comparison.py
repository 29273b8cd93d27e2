"""Two sweeps compared, each statement with its test."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from statistics import median

from missions.bench.bench import wilson
from missions.sweeps.figures import MEASURES, SHOWN, Measure
from missions.sweeps.report.results import Results
from missions.sweeps.row import SweepRow, counted
from missions.sweeps.statistics import mann_whitney, mcnemar, newcombe, wilcoxon

SIGNIFICANCE = 0.05
"""Significance level."""

MIN_VALUES = 8
"""Values of each sweep, or pairs, from which the normal approximation of rank tests holds."""


@dataclass(frozen=True, slots=True)
class Compared:
    """A figure of two sweeps.

    Attributes:
        figure: its name.
        values: of the first and of the second sweep, as text.
        statement: the difference of the second to the first, and what the test says.
        is_significant: whether the difference is significant.
    """

    figure: str
    values: tuple[str, str]
    statement: str
    is_significant: bool


def compared(first: Results, second: Results) -> Iterator[Compared]:
    """Yield the figures of two sweeps, that of success first."""
    pairs = pairs_of(first, second)
    yield _success(first, second, pairs)
    for measure in map(MEASURES.__getitem__, SHOWN):
        differences = _differences(measure, pairs)
        if len(differences) >= MIN_VALUES:
            before, after = ([*values] for values in zip(*differences, strict=True))
            change = [new - old for old, new in differences]
            p_value = wilcoxon(change)
            statement = (
                f"median difference {median(change):+.3g} {measure.unit} in {len(change)} pairs;"
                f" Wilcoxon signed-rank p = {_p(p_value)}"
            )
        else:
            before, after = measure.judged(first.counting), measure.judged(second.counting)
            if min(len(before), len(after)) < MIN_VALUES:
                continue
            share, p_value = mann_whitney(after, before)
            statement = f"larger in {share:.0%} of all pairs; Mann-Whitney p = {_p(p_value)}"
        yield Compared(
            f"{measure.title}{' of the successes' * measure.of_successes}",
            (f"{median(before):.3g} {measure.unit}", f"{median(after):.3g} {measure.unit}"),
            statement,
            p_value < SIGNIFICANCE,
        )


def _differences(
    measure: Measure, pairs: Sequence[tuple[SweepRow, SweepRow]]
) -> list[tuple[float, float]]:
    """Return the values of the pairs in which both runs are judged by the measure."""
    found = [(measure.judged([one]), measure.judged([other])) for one, other in pairs]
    return [(before[0], after[0]) for before, after in found if before and after]


def _success(
    first: Results, second: Results, pairs: Sequence[tuple[SweepRow, SweepRow]]
) -> Compared:
    rates = _rate(first), _rate(second)
    if pairs:
        lost = sum(one.is_success and not other.is_success for one, other in pairs)
        won = sum(other.is_success and not one.is_success for one, other in pairs)
        p_value = mcnemar(lost, won)
        statement = (
            f"{len(pairs)} pairs with the same seed and settings: {won} succeed only in the second,"
            f" {lost} only in the first; McNemar (exact) p = {_p(p_value)}"
        )
        return Compared("success", rates, statement, p_value < SIGNIFICANCE)
    one, other = counted(second.rows), counted(first.rows)
    if not (one[1] and other[1]):
        return Compared("success", rates, "one of them has no run that counts", False)
    low, high = newcombe(one, other)
    difference = one[0] / one[1] - other[0] / other[1]
    statement = f"{difference:+.1%}, 95 % interval {low:+.1%} to {high:+.1%} (Newcombe, unpaired)"
    return Compared("success", rates, statement, low > 0.0 or high < 0.0)


def pairs_of(first: Results, second: Results) -> list[tuple[SweepRow, SweepRow]]:
    """Return the runs with the same number, seed and settings; none if any common run differs."""
    others = {row.number: row for row in second.counting}
    pairs = [(row, others[row.number]) for row in first.counting if row.number in others]
    same = all(one.seed == two.seed and one.settings == two.settings for one, two in pairs)
    return pairs if same else []


def _rate(results: Results) -> str:
    successes, runs = counted(results.rows)
    if not runs:
        return "no run"
    low, high = wilson(successes, runs)
    return f"{successes}/{runs}, {successes / runs:.1%} ({low:.1%} to {high:.1%})"


def _p(p_value: float) -> str:
    return "< 0.001" if p_value < 0.001 else f"{p_value:.3f}"
