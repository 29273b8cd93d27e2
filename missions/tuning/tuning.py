"""Runs of a tuning: baseline, samples, refinement, and confirmation of the best setting."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil
from pathlib import Path

from missions.bench.bench import Key, Options
from missions.bench.mission_runs import MISSIONS, MissionEntry, MissionRun, settings_of
from missions.bench.run_table import fill, record_settings, rows_in
from missions.execution.prepare import PreparedMission, prepare
from missions.tuning.ranges import Range, read_ranges
from missions.tuning.sampling import Settings, refined_box, sampled
from missions.tuning.scoring import MEASURES, Score, Weights, best_first, scores_of
from stack.errors import InputError

Log = Callable[[str], None]

BASELINE: Settings = {}
"""Settings of the unchanged mission."""

DEFAULT_WEIGHTS: Weights = {measure.name: measure.weight for measure in MEASURES}


@dataclass(frozen=True)
class TuneOptions:
    """Extent of a tuning.

    Attributes:
        out: folder of the table. jobs: processes.
        samples: settings besides the baseline. seeds: runs per setting.
        refine: refinements, each with half as many samples around the best third.
        confirm: new seeds on which the best setting is compared with the baseline at the end.
        time_limit: simulated seconds per run.
        sampling_seed: seed of the samples.
        weights: weights of the measures in the cost.
    """

    out: Path
    jobs: int = 1
    samples: int = 20
    seeds: int = 3
    refine: int = 0
    confirm: int = 3
    time_limit: float = 900.0
    sampling_seed: int = 0
    weights: Weights = field(default_factory=lambda: DEFAULT_WEIGHTS)


@dataclass(frozen=True)
class TuningResult:
    """Result of a tuning.

    Attributes:
        plan: the unchanged mission.
        ranges: the tried parameters.
        scores: scores of the baseline and of each setting, in the order in which they were tried.
        confirmed: scores of the baseline and the best setting on new seeds; empty without any.
        left_out: settings that the mission refuses, with the reason.
    """

    plan: PreparedMission
    ranges: Sequence[Range]
    scores: Sequence[Score]
    confirmed: Sequence[Score] = ()
    left_out: Sequence[tuple[Settings, str]] = ()

    @property
    def best(self) -> Score:
        """Score with the smallest cost; the baseline if no setting is better."""
        return best_first(self.scores)[0]


class Tuning:
    """Fills a table with runs of a mission under different settings."""

    def __init__(
        self, entry: MissionEntry, given: Mapping[str, str], options: TuneOptions, log: Log
    ) -> None:
        """Read and check the mission, the ranges and the samples; nothing runs yet.

        Args:
            entry: the mission, its arguments and robot; seed, limit and parameters are replaced.
            given: the ranges, as text by name.
            options: extent of the tuning.
            log: receives lines of progress.

        Raises:
            InputError: the mission, a range or a value has errors.
        """
        self.options, self._log = options, log
        self._entry = replace(entry, time_limit=options.time_limit)
        self.plan = prepare(entry.mission, entry.options)
        self.ranges = read_ranges(given, self.plan)
        self.left_out: list[tuple[Settings, str]] = []
        self.settings: list[Settings] = [BASELINE]
        self._add(sampled(self.ranges, options.samples, options.sampling_seed))
        if len(self.settings) == 1:
            raise InputError(f"every sample is refused; the first: {self.left_out[0][1]}")
        record_settings(options.out, {"tune": settings_of(self._entry)})

    def run(self) -> TuningResult:
        """Make all runs that are missing in the table.

        Raises:
            InputError: the file in the folder is not a table of such runs.
        """
        options, seeds = self.options, range(self.options.seeds)
        self._fill(self.settings, seeds)
        for turn in range(1, options.refine + 1):
            ranked = [score for score in best_first(self.so_far().scores) if score.settings]
            best = [score.settings for score in ranked[: max(1, ceil(len(ranked) / 3))]]
            box = refined_box(self.ranges, best, turn)
            more = ceil(options.samples / 2)
            self._add(sampled(self.ranges, more, options.sampling_seed + turn, box))
            self._log(f"refining, turn {turn}: {_shown(self.ranges, box)}")
            self._fill(self.settings, seeds)
        tuned = self.so_far()
        if options.confirm and tuned.best.settings:
            self._log("confirming the best setting against the baseline on new seeds")
            both = [BASELINE, tuned.best.settings]
            new_seeds = range(options.seeds, options.seeds + options.confirm)
            runs = self._fill(both, new_seeds)
            tuned = replace(tuned, confirmed=self._scored(both, runs))
        return tuned

    def so_far(self) -> TuningResult:
        """Return the result over the settings whose runs are complete.

        Raises:
            InputError: the runs of the baseline are not complete.
        """
        rows = rows_in(self.options.out, MissionRun)
        seeds = range(self.options.seeds)
        complete = [one for one in self.settings if self._is_complete(one, rows)]
        if BASELINE not in complete:
            raise InputError(f"{self.options.out} does not have all runs of the baseline yet")
        runs = [rows[self._at(one, seed).key] for one in complete for seed in seeds]
        scores = self._scored(complete, runs)
        return TuningResult(self.plan, self.ranges, scores, (), self.left_out)

    @property
    def has_baseline(self) -> bool:
        """Whether the runs of the baseline are complete."""
        return self._is_complete(BASELINE, rows_in(self.options.out, MissionRun))

    def _is_complete(self, settings: Settings, rows: Mapping[Key, MissionRun]) -> bool:
        return all(self._at(settings, seed).key in rows for seed in range(self.options.seeds))

    def _add(self, settings: Sequence[Settings]) -> None:
        """Add new settings that the mission accepts."""
        for one in settings:
            if one in self.settings:
                continue
            try:
                prepare(self._entry.mission, self._at(one, 0).options)
            except InputError as error:  # each value is valid alone, but not their combination
                self.left_out.append((one, str(error)))
                self._log(f"left out: {error}")
            else:
                self.settings.append(one)

    def _at(self, settings: Settings, seed: int) -> MissionEntry:
        options = replace(self._entry.options, seed=seed, parameters=settings)
        return replace(self._entry, options=options)

    def _fill(self, settings: Sequence[Settings], seeds: range) -> list[MissionRun]:
        entries = [self._at(one, seed) for one in settings for seed in seeds]
        return fill(MISSIONS, entries, Options(self.options.out, self.options.jobs), self._log)

    def _scored(self, settings: Sequence[Settings], runs: Sequence[MissionRun]) -> list[Score]:
        """Score runs that are in the order of the settings, equally many per setting."""
        each = len(runs) // len(settings)
        tried = [(one, runs[n * each : (n + 1) * each]) for n, one in enumerate(settings)]
        return scores_of(tried, self.options.weights)


def _shown(ranges: Sequence[Range], box: Sequence[tuple[float, float]]) -> str:
    """Return the box as text; the upper fraction of a range is exclusive."""
    ends = [
        (item.name, item.text_at(low), item.text_at(high - 1e-9))
        for item, (low, high) in zip(ranges, box, strict=True)
    ]
    return ", ".join(f"{name} {low}" + f"..{high}" * (high != low) for name, low, high in ends)
