"""Runs of a tuning: the baseline, Optuna's trials, and the best settings on seeds held out."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from io import RawIOBase
from itertools import count
from pathlib import Path
from time import perf_counter
from typing import Any

from missions.execution.prepare import PreparedMission, prepare
from missions.sweeps.checking import CheckedSweep
from missions.sweeps.design import RunDescription, Settings
from missions.sweeps.factors import Factor
from missions.sweeps.progress import duration_text
from missions.sweeps.row import REFUSED, SweepRow
from missions.sweeps.runner import ExecutionSettings, made_rows
from missions.sweeps.table import SweepFolder
from missions.sweeps.worker import SweepInputs
from missions.tuning.objectives import BY_NAME, Means, Objective, means_of
from missions.tuning.scoring import Score, front_of, score_of
from missions.tuning.study import Study
from stack.errors import InputError

Log = Callable[[str], None]

BASELINE: Settings = ()
"""Settings of the unchanged mission."""

MOST_REFUSED = 200
"""Proposals that the mission may refuse, one after another."""

MOST_HELD_OUT = 5
"""Settings of a front that run on the seeds held out."""


@dataclass(frozen=True)
class TuneOptions:
    """Extent of a tuning.

    Attributes:
        out: folder of the results.
        objectives: what is better.
        samples: settings besides the baseline. seeds: runs per setting.
        confirm: seeds held out, on which the best settings are compared with the baseline.
        sampling_seed: seed of the proposals.
        execution: processes.
    """

    out: Path
    objectives: tuple[Objective, ...]
    samples: int = 20
    seeds: int = 3
    confirm: int = 3
    sampling_seed: int = 0
    execution: ExecutionSettings = field(default_factory=ExecutionSettings)


@dataclass(frozen=True)
class TuningResult:
    """Result of a tuning.

    Attributes:
        plan: the unchanged mission.
        factors: the tried parameters.
        objectives: what is better.
        scores: of the baseline and of each setting, in the order in which they were proposed.
        held_out: scores of the baseline and the best settings on new seeds; empty without any.
        left_out: settings that the mission refuses, with the reason.
        importances: of each factor for each objective, from 0 to 1.
    """

    plan: PreparedMission
    factors: Sequence[Factor]
    objectives: Sequence[Objective]
    scores: Sequence[Score]
    held_out: Sequence[Score] = ()
    left_out: Sequence[tuple[Mapping[str, str], str]] = ()
    importances: Sequence[Mapping[str, float]] = ()

    @property
    def front(self) -> list[Score]:
        """The settings that no other one beats; with one objective the best one."""
        return front_of(self.scores, self.objectives)

    @property
    def best(self) -> Score:
        """The best setting by the first objective; the baseline if no setting is better."""
        return self.front[0]


@dataclass
class _Trial:
    """A trial that is not over.

    Attributes:
        trial: Optuna's.
        waiting: seeds that have not begun. running: those that have, without a result.
        judged: seeds whose values Optuna knows.
    """

    trial: Any
    settings: Settings
    waiting: list[int]
    running: set[int] = field(default_factory=set)
    judged: int = 0


class Tuning:
    """Makes the runs of a tuning. Its folder is one of a sweep, with Optuna's study.

    Args:
        checked: the mission and its factors.
        options: extent.
        log: receives lines of progress.

    Raises:
        InputError: Optuna is not installed, or the folder has other results.
    """

    def __init__(self, checked: CheckedSweep, options: TuneOptions, log: Log) -> None:
        self._checked, self.options, self._log = checked, options, log
        self._sweep, self._folder = checked.sweep, SweepFolder(options.out)
        self._open: list[_Trial] = []
        self._rows: dict[tuple[Settings, int], SweepRow] = {}
        self._left_out: list[tuple[Mapping[str, str], str]] = []
        self._over = self._over_before = 0
        self._began = perf_counter()

    def run(self) -> TuningResult:
        """Make all runs that are missing; return the result.

        Raises:
            InputError: the folder has other results, or the mission lacks a measure.
        """
        options = self.options
        with self._folder.open_journal() as journal:
            for row in self._folder.begin(self._checked):
                self._rows[_key(row)] = row
            known = dict.fromkeys(settings for settings, _ in self._rows if settings != BASELINE)
            self._study = Study(
                options.out, self._sweep.factors, options.objectives, options.seeds,
                options.sampling_seed, map(dict, known),
            )  # fmt: skip
            self._over = self._over_before = len(self._study.ended())
            if self._rows:
                self._log(f"{len(self._rows)} runs are already there")
            try:
                self._make(journal, self._wanted())
                if options.confirm and self.has_baseline:
                    self._make(journal, self._held_out())
            finally:
                self._folder.tabulate([*self._rows.values()], self._sweep)
        return self.so_far()

    @property
    def has_baseline(self) -> bool:
        """Whether the runs of the baseline are complete."""
        return all((BASELINE, seed) in self._rows for seed in range(self.options.seeds))

    def so_far(self) -> TuningResult:
        """Return the result over the settings that are over; the baseline's runs are complete."""
        options = self.options
        plan = prepare(self._sweep.mission, self._sweep.options({}, 0))
        seeds = range(options.seeds)
        found: dict[Settings, Score] = {BASELINE: self._score(BASELINE, seeds)}
        for settings, is_pruned in self._study.ended():
            key = tuple(settings.items())
            found[key] = self._score(key, seeds, is_pruned=is_pruned)
        result = TuningResult(
            plan, self._sweep.factors, options.objectives, [*found.values()], (), self._left_out,
            self._study.importances(),
        )  # fmt: skip
        new = range(options.seeds, options.seeds + options.confirm)
        ran = [one for one in (BASELINE, *_best_of(result)) if (one, new[-1] if new else -1) in
               self._rows]  # fmt: skip
        held_out = [self._score(one, new) for one in ran] if len(ran) > 1 else []
        return TuningResult(**{**vars(result), "held_out": held_out})

    def _wanted(self) -> Iterator[RunDescription]:
        """Yield the runs of baseline and trials; each follows from the results so far."""
        numbers = count(max((row.number for row in self._rows.values()), default=-1) + 1)
        for seed in range(self.options.seeds):
            if (BASELINE, seed) not in self._rows:
                yield RunDescription(next(numbers), seed)
        self._settle()
        while (found := self._next_seed()) is not None:
            trial, seed = found
            yield RunDescription(next(numbers), seed, trial.settings)

    def _next_seed(self) -> tuple[_Trial, int] | None:
        """Return the next run: of a trial that is waiting, of a new one, or else one ahead."""
        idle = (one for one in self._open if one.waiting and not one.running)
        ahead = (one for one in self._open if one.waiting)
        trial = next(idle, None) or self._begun() or next(ahead, None)
        if trial is None:
            return None
        seed = trial.waiting.pop(0)
        trial.running.add(seed)
        return trial, seed

    def _begun(self) -> _Trial | None:
        """Begin a trial with a run that is missing, if there are to be more."""
        refused = 0
        while self._over + len(self._open) < self.options.samples:
            asked = self._study.ask()
            settings = self._study.settings_of(asked)
            try:
                prepare(self._sweep.mission, self._sweep.options(settings, 0))
            except InputError as error:  # each value is valid alone, but not their combination
                self._refuse(asked, settings, str(error))
                refused += 1
                if refused == MOST_REFUSED:
                    raise InputError(f"{refused} samples are refused; the last: {error}") from None
                continue
            key = tuple(settings.items())
            seeds = [seed for seed in range(self.options.seeds) if (key, seed) not in self._rows]
            self._open.append(_Trial(asked, key, seeds))
            self._settle()
            if self._open and self._open[-1].trial is asked:
                return self._open[-1]
        return None

    def _refuse(self, asked: Any, settings: Mapping[str, str], why: str) -> None:
        self._study.refuse(asked)
        self._left_out.append((settings, why))
        self._log(f"left out: {why}")

    def _make(self, journal: RawIOBase, runs: Iterable[RunDescription]) -> None:
        inputs = SweepInputs(
            self._sweep, self._folder.runs, self._checked.paths, diagnoses=False,
            measures_driving=True,
        )  # fmt: skip
        with closing(made_rows(inputs, runs, self.options.execution)) as made:
            for row in made:
                self._folder.write(journal, row)
                self._rows[_key(row)] = row
                for trial in self._open:
                    if trial.settings == _key(row)[0]:
                        trial.running.discard(row.seed)
                self._settle()

    def _settle(self) -> None:
        """Judge the trials by their rows, once the baseline is known."""
        if not self.has_baseline:
            return
        reference = self._reference()
        for trial in list(self._open):
            if self._judge(trial, reference):
                self._open.remove(trial)

    def _judge(self, trial: _Trial, reference: Means) -> bool:
        """Tell Optuna the values of a trial's seeds; return whether it is over."""
        options, rows = self.options, []
        for seed in range(options.seeds):
            row = self._rows.get((trial.settings, seed))
            if row is None:
                return False
            if row.outcome == REFUSED:
                self._refuse(trial.trial, dict(trial.settings), row.reason)
                return True
            rows.append(row)
            if seed < trial.judged or len(rows) == options.seeds:
                continue
            trial.judged += 1
            value = _mean(options.objectives[0], rows, reference)
            if self._study.is_hopeless(trial.trial, value, seed):
                self._study.prune(trial.trial)
                self._tell_end(trial, rows, reference, is_pruned=True)
                return True
        self._study.tell(trial.trial, [_mean(one, rows, reference) for one in options.objectives])
        self._tell_end(trial, rows, reference)
        return True

    def _tell_end(
        self, trial: _Trial, rows: Sequence[SweepRow], reference: Means, *, is_pruned: bool = False
    ) -> None:  # fmt: skip
        options = self.options
        self._over += 1
        left = options.samples - self._over
        pace = (perf_counter() - self._began) / (self._over - self._over_before)
        values = ", ".join(
            f"{one.name} {_mean(one, rows, reference):.4g}{one.unit and ' '}{one.unit}"
            for one in options.objectives
        )
        good = sum(row.is_success for row in rows)
        end = f"pruned after {len(rows)} of {options.seeds} seeds" if is_pruned else ""
        parts = [values, f"success {good}/{len(rows)}", end,
                 " ".join(f"{name}={text}" for name, text in trial.settings),
                 f"{duration_text(left * pace / 60.0)} left" if left else ""]  # fmt: skip
        self._log(f"{self._over:4d}/{options.samples}  {'; '.join(filter(None, parts))}")

    def _held_out(self) -> Iterator[RunDescription]:
        """Yield the runs of the baseline and the best settings on new seeds."""
        best = _best_of(self.so_far())
        if not best:
            return
        numbers = count(max(row.number for row in self._rows.values()) + 1)
        self._log("comparing the best settings with the baseline on seeds held out")
        for settings in (BASELINE, *best):
            for seed in range(self.options.seeds, self.options.seeds + self.options.confirm):
                if (settings, seed) not in self._rows:
                    yield RunDescription(next(numbers), seed, settings)

    def _reference(self) -> Means:
        """Return the means of the baseline's successes, or else those of the first success.

        Raises:
            InputError: the successes lack a measure that is an objective.
        """
        known = self._study.reference
        if known is not None:
            return known
        seeds = range(self.options.seeds)
        baseline = [self._rows[BASELINE, seed] for seed in seeds]
        ordered = sorted(self._rows.values(), key=lambda row: row.number)
        good = [row for row in baseline if row.is_success] or [
            row for row in ordered if row.is_success
        ][:1]
        if not good:
            return {}
        means = means_of(good)
        for objective in self.options.objectives:
            if objective.name in BY_NAME and objective.name not in means:
                raise InputError(
                    f"the mission {Path(self._sweep.mission).stem} has no {objective.name}:"
                    f" {BY_NAME[objective.name].help}"
                )
        self._study.keep_reference(means)
        return means

    def _score(self, settings: Settings, seeds: Iterable[int], *, is_pruned: bool = False) -> Score:
        seeds = list(seeds)
        runs = [row for seed in seeds if (row := self._rows.get((settings, seed))) is not None]
        baseline = [self._rows[BASELINE, seed] for seed in seeds]
        return score_of(
            (dict(settings), runs), baseline, self.options.objectives, self._reference(),
            is_pruned=is_pruned,
        )  # fmt: skip


def _best_of(result: TuningResult) -> list[Settings]:
    """Return the settings that are worth a comparison: the best, or some along the front."""
    front = result.front if len(result.objectives) > 1 else [result.best]
    found = [tuple(one.settings.items()) for one in front if one.settings]
    most = min(MOST_HELD_OUT, len(found))
    return [found[round(n * (len(found) - 1) / max(most - 1, 1))] for n in range(most)]


def _mean(objective: Objective, rows: Sequence[SweepRow], reference: Means) -> float:
    return sum(objective.value(row, reference) for row in rows) / len(rows)


def _key(row: SweepRow) -> tuple[Settings, int]:
    return tuple(row.settings.items()), row.seed
