"""Tries settings of a mission: baseline, samples, refinement, and a second look at the best."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil
from pathlib import Path

from missions.bench.mission_runs import MISSION_WORK, MissionEntry, MissionRun, conditions
from missions.bench.resumable import Key, TableOptions, claim, fill, rows_in
from missions.execution.prepare import PreparedMission, prepare
from missions.tuning.ranges import Range, read_ranges
from missions.tuning.sampling import Settings, refined_box, sampled
from missions.tuning.scoring import MEASURES, Score, Weights, best_first, scores_of
from stack.errors import InputError

Tell = Callable[[str], None]

AS_IT_IS: Settings = {}
"""The baseline: nothing is set."""

USUAL_WEIGHTS: Weights = {measure.name: measure.weight for measure in MEASURES}


@dataclass(frozen=True)
class TuneOptions:
    """What is tried, and how thoroughly.

    Attributes:
        out: the table's folder. jobs: processes.
        samples: settings beside the baseline. seeds: runs of each.
        refine: turns of half as many samples again, round the best third.
        confirm: seeds not used before, on which the best is compared with the baseline at the end.
        time_limit: simulated seconds a run.
        sampling_seed: other samples with another one.
        weights: of the measures in the cost.
    """

    out: Path
    jobs: int = 1
    samples: int = 20
    seeds: int = 3
    refine: int = 0
    confirm: int = 3
    time_limit: float = 900.0
    sampling_seed: int = 0
    weights: Weights = field(default_factory=lambda: USUAL_WEIGHTS)


@dataclass(frozen=True)
class Tuned:
    """What came of it.

    Attributes:
        plan: the mission as it is.
        ranges: what was tried.
        scores: of the baseline, then of each setting in the order in which it was tried.
        confirmed: of baseline and best on further seeds; empty when there were none.
        left_out: settings that the mission refuses, and why.
    """

    plan: PreparedMission
    ranges: Sequence[Range]
    scores: Sequence[Score]
    confirmed: Sequence[Score] = ()
    left_out: Sequence[tuple[Settings, str]] = ()

    @property
    def best(self) -> Score:
        """Of the smallest cost; the baseline, if nothing is better."""
        return best_first(self.scores)[0]


class Tuning:
    """Fills a table with runs of a mission under different settings."""

    def __init__(
        self, entry: MissionEntry, given: Mapping[str, str], options: TuneOptions, tell: Tell
    ) -> None:
        """Read and check everything; nothing has run yet.

        Args:
            entry: the mission, its arguments and robot; what else it says is replaced.
            given: the ranges, as text by name.
            options: how thoroughly.
            tell: takes lines for the person who waits.

        Raises:
            InputError: the mission, a range or a value is wrong.
        """
        self.options, self._tell = options, tell
        self._entry = replace(entry, time_limit=options.time_limit)
        self.plan = prepare(entry.mission, entry.options)
        self.ranges = read_ranges(given, self.plan)
        self.left_out: list[tuple[Settings, str]] = []
        self.settings: list[Settings] = [AS_IT_IS]
        self._add(sampled(self.ranges, options.samples, options.sampling_seed))
        if len(self.settings) == 1:
            raise InputError(f"no sample can be run; the first: {self.left_out[0][1]}")
        claim(options.out, {"tune": conditions(self._entry, self.plan)})

    def run(self) -> Tuned:
        """Make all runs that the table does not hold yet.

        Raises:
            InputError: the folder holds something else.
        """
        options, seeds = self.options, range(self.options.seeds)
        self._fill(self.settings, seeds)
        for turn in range(1, options.refine + 1):
            ranked = [score for score in best_first(self.so_far().scores) if score.settings]
            best = [score.settings for score in ranked[: max(1, ceil(len(ranked) / 3))]]
            box = refined_box(self.ranges, best, turn)
            more = ceil(options.samples / 2)
            self._add(sampled(self.ranges, more, options.sampling_seed + turn, box))
            self._tell(f"refining, turn {turn}: {_shown(self.ranges, box)}")
            self._fill(self.settings, seeds)
        tuned = self.so_far()
        if options.confirm and tuned.best.settings:
            self._tell("the best and the mission as it is, on seeds not used before")
            both = [AS_IT_IS, tuned.best.settings]
            fresh = range(options.seeds, options.seeds + options.confirm)
            runs = self._fill(both, fresh)
            tuned = replace(tuned, confirmed=self._scored(both, runs))
        return tuned

    def so_far(self) -> Tuned:
        """What the table holds of all settings whose every seed has been run.

        Raises:
            InputError: not even the baseline is complete.
        """
        rows = rows_in(self.options.out, MISSION_WORK)
        seeds = range(self.options.seeds)
        complete = [one for one in self.settings if self._is_complete(one, rows)]
        if AS_IT_IS not in complete:
            raise InputError(f"{self.options.out} does not hold the mission as it is yet")
        runs = [rows[self._at(one, seed).key] for one in complete for seed in seeds]
        scores = self._scored(complete, runs)
        return Tuned(self.plan, self.ranges, scores, (), self.left_out)

    @property
    def has_baseline(self) -> bool:
        """Whether there is anything to compare with yet."""
        return self._is_complete(AS_IT_IS, rows_in(self.options.out, MISSION_WORK))

    def _is_complete(self, settings: Settings, rows: Mapping[Key, MissionRun]) -> bool:
        return all(self._at(settings, seed).key in rows for seed in range(self.options.seeds))

    def _add(self, settings: Sequence[Settings]) -> None:
        """More settings, but those that were there and those that the mission refuses."""
        for one in settings:
            if one in self.settings:
                continue
            try:
                prepare(self._entry.mission, self._at(one, 0).options)
            except InputError as error:  # each value will do, but not with the others
                self.left_out.append((one, str(error)))
                self._tell(f"left out: {error}")
            else:
                self.settings.append(one)

    def _at(self, settings: Settings, seed: int) -> MissionEntry:
        return replace(self._entry, seed=seed, parameters=settings)

    def _fill(self, settings: Sequence[Settings], seeds: range) -> list[MissionRun]:
        entries = [self._at(one, seed) for one in settings for seed in seeds]
        table = TableOptions(self.options.out, self.options.jobs)
        return fill(entries, table, MISSION_WORK, self._tell)

    def _scored(self, settings: Sequence[Settings], runs: Sequence[MissionRun]) -> list[Score]:
        """Runs in the order of the settings, as many of each."""
        each = len(runs) // len(settings)
        tried = [(one, runs[n * each : (n + 1) * each]) for n, one in enumerate(settings)]
        return scores_of(tried, self.options.weights)


def _shown(ranges: Sequence[Range], box: Sequence[tuple[float, float]]) -> str:
    """Each part of a range; its upper end is not a part of it."""
    ends = [
        (item.name, item.text_at(low), item.text_at(high - 1e-9))
        for item, (low, high) in zip(ranges, box, strict=True)
    ]
    return ", ".join(f"{name} {low}" + f"..{high}" * (high != low) for name, low, high in ends)
