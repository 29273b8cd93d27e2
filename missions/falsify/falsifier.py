"""Runs a search for settings that break a mission, on the processes of sweeps.

OUT/sweep.json, journal.jsonl, runs.parquet   as of a sweep; shrinking has the numbers after it
OUT/falsified.yaml                            the mission that breaks
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from io import RawIOBase
from typing import Any

from missions.bench.processes import Processes, results
from missions.execution.faults import PREFIX
from missions.execution.prepare import prepare
from missions.execution.records.origins import origins_of
from missions.falsify.margin import Requirement, margin_of
from missions.falsify.search import Search
from missions.falsify.shrinking import Number, Shrinking
from missions.sweeps.checking import CheckedSweep
from missions.sweeps.design import RunDescription
from missions.sweeps.factors import Factor
from missions.sweeps.row import SweepRow
from missions.sweeps.runner import RUNS_PER_PROCESS, SILENCE, row_of
from missions.sweeps.sweep import FAULTS, NONE, Sweep
from missions.sweeps.table import SweepFolder
from missions.sweeps.worker import SweepInputs, start_worker
from stack.errors import InputError, ParameterError
from stack.parameters import read_quantity, units
from stack.sim.faults.registry import fault_kind, fault_names

SHRINK_RUNS = 60
"""Runs that shrinking may take."""

ALL_ROWS = 1 << 30


@dataclass(frozen=True)
class Trial:
    """A run with its margin.

    Attributes:
        settings: of the run.
    """

    row: SweepRow
    margin: float

    @property
    def settings(self) -> Mapping[str, str]:
        """The settings of the run."""
        return self.row.settings


@dataclass(frozen=True)
class Outcome:
    """What a search has found.

    Attributes:
        runs: of the search.
        worst: the run with the least margin.
        shrunk: the simplest run that still breaks; None if none breaks.
    """

    runs: int
    worst: Trial
    shrunk: Trial | None


Tell = Callable[[str], None]


class Falsifier:
    """Searches, shrinks, and keeps every run in the journal of a folder.

    All runs have one seed, so that a margin depends on the settings alone.

    Args:
        checked: the factors, as a sweep; its number of runs is the budget.
        requirements: of which the margins are the least.
        folder: of the results.
        jobs: processes.
        tell: shows a line of progress.
    """

    def __init__(
        self, checked: CheckedSweep, requirements: Sequence[Requirement], folder: SweepFolder,
        jobs: int, tell: Tell,
    ) -> None:  # fmt: skip
        self._checked, self._sweep = checked, checked.sweep
        self._requirements, self._folder = requirements, folder
        self._jobs, self._tell = jobs, tell
        inputs = SweepInputs(self._sweep, folder.runs)
        self._processes = Processes(
            partial(start_worker, inputs), jobs, RUNS_PER_PROCESS, silence=SILENCE
        )
        self._known: dict[int, SweepRow] = {}
        self._number = 0

    def run(self) -> Outcome:
        """Search until a run breaks or the budget is spent; then shrink.

        Raises:
            InputError: the folder has another search, or cannot be written.
        """
        sweep = self._sweep
        with closing(self._processes), self._folder.open_journal() as journal:
            self._folder.begin(self._checked)
            self._known = {row.number: row for row in self._folder.rows(ALL_ROWS)}
            try:
                trials = self._searched(journal)
            finally:
                searched = [row for row in self._known.values() if row.number < sweep.runs]
                self._folder.tabulate(searched, sweep)
            worst = min(trials, key=lambda one: one.margin)
            if worst.margin >= 0.0:
                return Outcome(len(trials), worst, None)
            self._tell(f"run {worst.row.number} breaks it: {describe(worst)}; shrinking")
            return Outcome(len(trials), worst, self._shrunk(journal, worst))

    def _searched(self, journal: RawIOBase) -> list[Trial]:
        sweep, trials = self._sweep, list[Trial]()
        search = Search(len(sweep.factors), sweep.runs, sweep.seed)
        while points := search.ask(max(8, 2 * self._jobs)):
            settings = [
                {factor.name: factor.at(float(share)) for factor, share in zip(
                    sweep.factors, point, strict=True
                )} for point in points
            ]  # fmt: skip
            made = list(self._made(journal, settings))
            search.tell(points, [one.margin for one in made])
            trials += made
            least = min(trials, key=lambda one: one.margin)
            self._tell(f"{len(trials)}/{sweep.runs} runs, least margin {describe(least)}")
            if least.margin < 0.0:
                break
        return trials

    def _shrunk(self, journal: RawIOBase, worst: Trial) -> Trial:
        self._number = self._sweep.runs
        numbers = numbers_of(self._sweep)
        given = {FAULTS: self._sweep.faults} if self._sweep.faults else {}
        begin = {**given, **worst.settings}
        simplest = [replace(worst, row=replace(worst.row, settings=begin))]

        def fails(settings: Mapping[str, str]) -> bool:
            (trial,) = self._made(journal, [dict(settings)])
            if trial.margin < 0.0:
                simplest[0] = trial
            return trial.margin < 0.0

        shrinking = Shrinking(fails, numbers, SHRINK_RUNS)
        found = shrinking.shrink(begin)
        if simplest[0].settings != found:  # nothing could be simplified
            simplest[0] = replace(worst, row=replace(worst.row, settings=found))
        return simplest[0]

    def _made(self, journal: RawIOBase, settings: Sequence[dict[str, str]]) -> Iterator[Trial]:
        """Yield the trials of settings in their order; those in the journal are not run again."""
        runs = [
            RunDescription(self._number + n, self._sweep.seed, tuple(item.items()))
            for n, item in enumerate(settings)
        ]
        self._number += len(runs)
        missing = [run for run in runs if not self._has(run)]
        for run, result in self._processes.results(missing):
            row = row_of(run, result, self._folder)
            self._folder.write(journal, row)
            self._known[run.number] = row
        for run in runs:
            row = self._known[run.number]
            yield Trial(row, margin_of(row, self._requirements))

    def _has(self, run: RunDescription) -> bool:
        """Whether the journal has a run: the same search asks for the same ones."""
        row = self._known.get(run.number)
        return row is not None and dict(row.settings) == dict(run.settings)


def describe(trial: Trial) -> str:
    """Return margin, outcome and settings of a trial in a line."""
    settings = " ".join(f"{name}={text}" for name, text in trial.settings.items())
    return f"{figures_of(trial)}: {settings or 'no settings'}"


def figures_of(trial: Trial) -> str:
    """Return margin and outcome of a trial."""
    row = trial.row
    parts = [
        row.outcome, "a collision" if row.collisions else "",
        "" if row.clearance is None else f"clearance {row.clearance:.2f} m", row.reason,
    ]  # fmt: skip
    return f"{trial.margin:.3g} ({', '.join(filter(None, parts))})"


def baseline(sweep: Sweep, folder: SweepFolder) -> SweepRow:
    """Return the run without faults and with all defaults.

    Raises:
        InputError: the mission refuses it.
    """
    plain = replace(sweep, factors=(), faults=None, keep=NONE)
    inputs = SweepInputs(plain, folder.runs)
    run = RunDescription(0, sweep.seed, ((FAULTS, "none"),) if sweep.faults else ())
    ((_, result),) = results(partial(start_worker, inputs), [run], 1, 1, silence=SILENCE)
    row = row_of(run, result, folder)
    if not row.counts:
        raise InputError(row.reason)
    return row


def numbers_of(sweep: Sweep) -> Callable[[str, str], Number | None]:
    """Return what reads a setting of a sweep as a number, with its default."""
    options = sweep.options({}, sweep.seed)
    plan = prepare(sweep.mission, replace(options, faults=sweep.faults))
    origins = {one.name: one.value for one in origins_of(plan, options.parameters or {})}
    factors: dict[str, Factor] = {factor.name: factor for factor in sweep.factors}

    def default_of(name: str) -> Any:
        if name.startswith(PREFIX):
            kind, _, number = name.removeprefix(PREFIX).partition(".")
            if number == "for":
                return 0.0
            if kind not in fault_names():
                return None
            return getattr(fault_kind(kind).Parameters(), number, None)
        return plan.mission.arguments.get(name, origins.get(name))

    def number(name: str, text: str) -> Number | None:
        factor = factors.get(name)
        if factor is None or factor.is_list:
            return None
        value, default = factor.typed(text), default_of(name)
        if isinstance(value, str):
            return None
        return Number(float(value), factor.unit, _in_unit(default, factor.unit))

    return number


def _in_unit(default: Any, unit: str) -> float | None:
    """Return a default, in SI units or as a text, in the unit of a factor; None if it is none."""
    dimension, factor = units().get(unit, ("", 1.0))
    if isinstance(default, bool) or not isinstance(default, int | float | str):
        return None
    try:
        number = read_quantity(default, dimension) if isinstance(default, str) else float(default)
    except ParameterError:
        return None
    return number / factor
