"""Runs a search for settings that break a mission, on the processes of sweeps.

OUT/sweep.json, journal.jsonl, runs.parquet   as of a sweep; shrinking has the numbers after it
OUT/falsified.yaml                            the mission that breaks
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from typing import Any

from missions.execution.fit.faults import PREFIX
from missions.execution.prepare import prepare
from missions.execution.records.origins import origins_of
from missions.falsify.margin import Requirement, margin_of
from missions.falsify.search import Search
from missions.falsify.shrinking import Number, Shrinking
from missions.sweeps.checking import CheckedSweep
from missions.sweeps.design import RunDescription
from missions.sweeps.factors import Factor
from missions.sweeps.row import SweepRow
from missions.sweeps.runner import ExecutionSettings, made_rows
from missions.sweeps.sweep import FAULTS, NONE, Sweep
from missions.sweeps.table import SweepFolder
from missions.sweeps.worker import SweepInputs
from stack.errors import InputError, ParameterError
from stack.parameters import read_quantity, units
from stack.sim.faults.registry import fault_kind, fault_names
from stack.types import FloatArray

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
Batches = Generator[list[RunDescription], None, None]


class Falsifier:
    """Searches, shrinks, and keeps every run in the journal of a folder.

    All runs have one seed, so that a margin depends on the settings alone.

    Args:
        checked: the factors, as a sweep; its number of runs is the budget.
        requirements: of which the margins are the least.
        folder: of the results.
        execution: processes and patience.
        tell: shows a line of progress.
    """

    def __init__(
        self, checked: CheckedSweep, requirements: Sequence[Requirement], folder: SweepFolder,
        execution: ExecutionSettings, tell: Tell,
    ) -> None:  # fmt: skip
        self._checked, self._sweep = checked, checked.sweep
        self._requirements, self._folder = requirements, folder
        self._execution, self._tell = execution, tell
        self._inputs = SweepInputs(self._sweep, folder.runs, checked.paths, diagnoses=False)
        self._known: dict[int, SweepRow] = {}
        self._number = 0
        self._trials: list[Trial] = []
        self._worst: Trial | None = None
        self._simplest: Trial | None = None

    def run(self) -> Outcome:
        """Search until a run breaks or the budget is spent; then shrink.

        Raises:
            InputError: the folder has another search, or cannot be written.
        """
        sweep = self._sweep
        with self._folder.open_journal() as journal:
            self._folder.begin(self._checked)
            self._known = {row.number: row for row in self._folder.rows(ALL_ROWS)}
            made = made_rows(self._inputs, _Feed(self._batches(), self._known), self._execution)
            try:
                with closing(made):
                    for row in made:
                        self._folder.write(journal, row)
                        self._known[row.number] = row
            finally:
                searched = [row for row in self._known.values() if row.number < sweep.runs]
                self._folder.tabulate(searched, sweep)
        assert self._worst is not None
        return Outcome(len(self._trials), self._worst, self._simplest)

    def _batches(self) -> Batches:
        """Yield the runs that are missing, a batch at a time; then they are known."""
        yield from self._search()
        assert self._worst is not None
        if self._worst.margin < 0.0:
            number = self._worst.row.number
            self._tell(f"run {number} breaks it: {describe(self._worst)}; shrinking")
            yield from self._shrink(self._worst)

    def _search(self) -> Batches:
        sweep = self._sweep
        search = Search(len(sweep.factors), sweep.runs, sweep.seed)
        while points := search.ask(max(8, 2 * self._execution.jobs)):
            runs = self._runs([_settings_at(sweep.factors, point) for point in points])
            yield self._missing(runs)
            made = [self._trial(run) for run in runs]
            search.tell(points, [one.margin for one in made])
            self._trials += made
            self._worst = min(self._trials, key=lambda one: one.margin)
            told = f"{len(self._trials)}/{sweep.runs} runs"
            self._tell(f"{told}, least margin {describe(self._worst)}")
            if self._worst.margin < 0.0:
                return

    def _shrink(self, worst: Trial) -> Batches:
        self._number = self._sweep.runs
        given = {FAULTS: self._sweep.faults} if self._sweep.faults else {}
        begin = {**given, **worst.settings}
        self._simplest = replace(worst, row=replace(worst.row, settings=begin))
        tries = Shrinking(numbers_of(self._sweep), SHRINK_RUNS).shrink(begin)
        try:
            settings = next(tries)
            while True:
                (run,) = self._runs([dict(settings)])
                yield self._missing([run])
                trial = self._trial(run)
                if trial.margin < 0.0:
                    self._simplest = trial
                settings = tries.send(trial.margin < 0.0)
        except StopIteration:
            return

    def _runs(self, settings: Sequence[dict[str, str]]) -> list[RunDescription]:
        """Return the next runs."""
        first = self._number
        self._number += len(settings)
        return [
            RunDescription(first + n, self._sweep.seed, tuple(item.items()))
            for n, item in enumerate(settings)
        ]

    def _trial(self, run: RunDescription) -> Trial:
        row = self._known[run.number]
        return Trial(row, margin_of(row, self._requirements))

    def _missing(self, runs: Sequence[RunDescription]) -> list[RunDescription]:
        """Return the runs that the journal lacks: the same search asks for the same ones."""
        missing = []
        for run in runs:
            row = self._known.get(run.number)
            if row is None or dict(row.settings) != dict(run.settings):
                self._known.pop(run.number, None)
                missing.append(run)
        return missing


class _Feed(Iterator[RunDescription]):
    """The runs of batches; it has none while runs of the batch are not over.

    Args:
        batches: is continued when all runs of a batch are known.
        known: rows by number.
    """

    def __init__(self, batches: Batches, known: Mapping[int, SweepRow]) -> None:
        self._batches, self._known = batches, known
        self._waiting: list[RunDescription] = []
        self._begun: list[RunDescription] = []

    def __next__(self) -> RunDescription:
        while not self._waiting:
            if any(run.number not in self._known for run in self._begun):
                raise StopIteration
            self._waiting, self._begun = next(self._batches), []
        self._begun.append(self._waiting.pop(0))
        return self._begun[-1]


def _settings_at(factors: Sequence[Factor], point: FloatArray) -> dict[str, str]:
    shares = zip(factors, point.tolist(), strict=True)
    return {factor.name: factor.at(share) for factor, share in shares}


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
    inputs = SweepInputs(plain, folder.runs, diagnoses=False)
    run = RunDescription(0, sweep.seed, ((FAULTS, "none"),) if sweep.faults else ())
    (row,) = made_rows(inputs, [run], ExecutionSettings())
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
