"""One run of a sweep as a function of its inputs and its description.

A process makes one `RunMaker` and calls it for each run. It keeps what runs can share: modules,
compiled kernels, prepared missions, and the simulation, which is reset. The row is the same as in a
process of its own. A worker on another machine needs the same: the files of the mission, unpacked,
with `SweepInputs` that name them.
"""

from __future__ import annotations

import gc
import resource
import shutil
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from statistics import mean
from tempfile import TemporaryDirectory
from time import perf_counter, process_time
from typing import Any

from missions.bench.drive_recorder import DriveRecorder
from missions.bench.processes import Alive
from missions.bench.shortest_path import shortest_path_lengths
from missions.execution.prepare import PreparedMission, prepare
from missions.execution.report import Report
from missions.execution.resources import versions
from missions.execution.run import Run, RunWatch
from missions.execution.running import execute
from missions.execution.shared_simulation import SharedSimulation
from missions.inspection.causes.ranking import causes_of
from missions.inspection.page.story import read_story
from missions.sweeps.design import RunDescription
from missions.sweeps.row import CRASHED, FAILURE, REFUSED, SUCCESS, TIME_LIMIT, SweepRow
from missions.sweeps.sweep import ALL, FAILURES, NONE, Sweep
from missions.sweeps.table import place_of
from robots.bodies import Simulated, body_kind
from stack.errors import InputError, NavigationError, exception_sentence, traceback_text
from stack.types import Pose2D

PLANS = 32
"""Prepared missions that a process keeps."""

INTERRUPTION = "commanded"
"""Cause that `diagnose` gives for an interrupted run: here the time limit interrupts it."""


@dataclass(frozen=True)
class SweepInputs:
    """What all runs of a sweep have in common.

    Attributes:
        sweep: the mission, its factors and options.
        runs: folder of the run folders, absolute.
        paths: files that its missions read, absolute; only machines of a cluster need them.
        diagnoses: whether a failure runs again with records, for its cause.
        measures_driving: whether rows have the figures of `row.DRIVING`.
    """

    sweep: Sweep
    runs: Path
    paths: tuple[Path, ...] = ()
    diagnoses: bool = True
    measures_driving: bool = False


def start_worker(inputs: SweepInputs, alive: Alive) -> RunMaker:
    """Return what makes the runs in a process."""
    return RunMaker(inputs, alive)


class RunMaker:
    """Makes runs of a sweep, one after another.

    Args:
        inputs: of the sweep.
        alive: called after each step.
    """

    def __init__(self, inputs: SweepInputs, alive: Alive = lambda: None) -> None:
        self._inputs, self._alive = inputs, alive
        self._plan = lru_cache(PLANS)(self._prepared)
        self._simulations = SharedSimulation()

    def __call__(self, run: RunDescription) -> SweepRow:
        """Make a run; a crash is a row."""
        began, computed = perf_counter(), process_time()
        try:
            row = self._made(run)
        except Exception as error:
            self.close()
            print(traceback_text(f"the run {run.number} crashed", error), file=sys.stderr)
            row = SweepRow.without_figures(run, CRASHED, exception_sentence(error), versions())
        gc.collect()  # engines are cyclic garbage: without this, 3 to 5 MB a run stay for long
        return replace(
            row, wall_seconds=round(perf_counter() - began, 3),
            cpu_seconds=round(process_time() - computed, 3), memory_mb=round(_memory(), 1),
        )  # fmt: skip

    def close(self) -> None:
        """Close the simulation."""
        self._simulations.close()

    def _made(self, run: RunDescription) -> SweepRow:
        """Run; a failure runs again with records, which `diagnose` reads. It is the same run.

        Recording costs more than a fifth of the time, and most runs succeed.
        """
        began = perf_counter()
        try:
            plan = self._plan(run.settings)
        except InputError as error:
            return SweepRow.without_figures(run, REFUSED, str(error), versions())
        prepared = perf_counter() - began
        folder = self._folder(run, plan) if self._inputs.sweep.keep == ALL else None
        row = _row(run, self._executed(plan, run, folder), prepared)
        if folder is not None:
            return self._diagnosed(row, folder, kept=True)
        is_done = row.is_success or not self._inputs.diagnoses
        return row if is_done else self._repeated(plan, run, row)

    def _repeated(self, plan: PreparedMission, run: RunDescription, row: SweepRow) -> SweepRow:
        """Run again with records; return the row with what they tell, or as it is without them."""
        try:
            with self._records(run, plan) as folder:
                again = self._executed(plan, run, folder)
                row = replace(row, is_repeatable=again.report.log_sha256 == row.event_hash)
                return self._diagnosed(row, folder, kept=self._inputs.sweep.keep == FAILURES)
        except Exception as error:
            self.close()
            print(traceback_text(f"the run {run.number} has no records", error), file=sys.stderr)
            return row

    def _prepared(self, settings: tuple[tuple[str, str], ...]) -> PreparedMission:
        sweep = self._inputs.sweep
        chosen = dict(settings)
        return prepare(sweep.mission_of(chosen), sweep.options(chosen, sweep.seed))

    def _executed(
        self, plan: PreparedMission, run: RunDescription, folder: Path | None
    ) -> _Executed:
        sweep = self._inputs.sweep
        options = replace(sweep.options(dict(run.settings), run.seed), out=folder)
        watch = _Watch(sweep.time_limit, self._alive)
        make_body = None
        if plan.recording is None and body_kind(plan.robot.body) is Simulated:
            make_body = self._simulations.body_of(plan, options)
        recorder = DriveRecorder() if self._inputs.measures_driving else None
        sinks = [] if recorder is None else [recorder]
        report = execute(plan, options, sinks, make_body=make_body, watch=watch)
        driving = {} if recorder is None else _driving(plan, report, recorder)
        return _Executed(report, watch.is_late, driving)

    def _folder(self, run: RunDescription, plan: PreparedMission) -> Path:
        """Return the empty folder of a run.

        A mission that keeps values writes them beside its run folders: each has a place of its own,
        since runs must not depend on those before.
        """
        place = place_of(self._inputs.runs, run.number)
        shutil.rmtree(place, ignore_errors=True)  # of an attempt that was interrupted
        keeps = any(symbol.keep for symbol in plan.mission.blackboard.values())
        return place / plan.mission.source.stem if keeps else place

    @contextmanager
    def _records(self, run: RunDescription, plan: PreparedMission) -> Iterator[Path]:
        """Return the folder of a run that failed: removed afterwards if none is kept."""
        if self._inputs.sweep.keep != NONE:
            yield self._folder(run, plan)
            return
        with TemporaryDirectory(prefix="treepilot-") as place:
            yield Path(place) / "run"

    def _diagnosed(self, row: SweepRow, folder: Path, *, kept: bool) -> SweepRow:
        if kept:
            row = replace(row, folder=str(folder.relative_to(self._inputs.runs.parent)))
        if row.is_success:
            return row
        try:
            story = read_story(folder)
            failed, every = story.failed, causes_of(story)
        except Exception as error:
            print(traceback_text(f"the run {row.number} has no cause", error), file=sys.stderr)
            return row
        causes = [cause.name for cause in every if cause.name != INTERRUPTION]
        node, code = ("", "") if failed is None else (failed.name, failed.code)
        return replace(row, node=node, code=code, cause=causes[0] if causes else "")


class _Watch(RunWatch):
    """Reports the progress of a run, and ends one that takes too long.

    Attributes:
        is_late: whether it was ended.
    """

    def __init__(self, time_limit: float, alive: Alive) -> None:
        self.is_late = False
        self._time_limit, self._alive, self._time = time_limit, alive, -1.0

    def stepped(self, run: Run) -> None:
        """Follow a step."""
        time = run.engine.body.time
        if time > self._time:
            self._time = time
            self._alive()
        if time >= self._time_limit and not run.state.is_over:
            self.is_late = True
            run.interrupt(f"not finished after {self._time_limit:g} s")


@dataclass(frozen=True, slots=True)
class _Executed:
    report: Report
    is_late: bool
    driving: Mapping[str, Any]


def _driving(
    plan: PreparedMission, report: Report, recorder: DriveRecorder
) -> dict[str, float | None]:
    """Return the figures of `row.DRIVING`."""
    errors = [goal.distance_to(truth) for goal, truth in recorder.reached]
    shortest = _shortest(plan, [truth for _, truth in recorder.reached])
    detour = report.distance_m / shortest if report.distance_m and shortest else None
    return {
        "detour": _rounded(detour),
        "turning": _rounded(recorder.turning), "jerk": _rounded(recorder.jerk),
        "goal_error": _rounded(mean(errors) if errors else None),
    }  # fmt: skip


def _shortest(plan: PreparedMission, stops: Sequence[Pose2D]) -> float | None:
    """Return the shortest length from the start over all stops, metres; straight without a path."""
    if not stops:
        return None
    chain = [plan.start, *stops]
    path_length = shortest_path_lengths(plan.world, plan.robot, chain)

    def length(here: Pose2D, there: Pose2D) -> float:
        try:
            return path_length(here, there)
        except NavigationError:
            return here.distance_to(there)

    return sum(length(here, there) for here, there in pairwise(chain))


def _row(run: RunDescription, executed: _Executed, prepared: float) -> SweepRow:
    """Return the row of a run, without what only its records tell."""
    report = executed.report
    error = report.localisation_error or {}
    end = report.final_pose.get("truth") or report.final_pose.get("estimate") or {}
    # Without the time limit only the end of a recording interrupts a run.
    outcomes = {"error": CRASHED, "interrupted": FAILURE, "success": SUCCESS, "failure": FAILURE}
    return SweepRow(
        run.number, run.seed, dict(run.settings),
        outcome=TIME_LIMIT if executed.is_late else outcomes.get(report.status, report.status),
        reason=report.reason,
        seconds=round(report.simulated_seconds, 3),
        distance=_rounded(report.distance_m),
        clearance=_rounded(report.min_clearance_m),
        collisions=report.collisions,
        pushed_into=report.pushed_into,
        error_mean=_rounded(error.get("mean")),
        error_max=_rounded(error.get("max")),
        recoveries=report.recoveries,
        replans=report.replans,
        end_x=_rounded(end.get("x")),
        end_y=_rounded(end.get("y")),
        real_time_factor=round(report.real_time_factor, 2),
        start_seconds=round(prepared + report.time_to_first_tick, 3),
        event_hash=report.log_sha256,
        versions=report.versions,
        **executed.driving,
    )  # fmt: skip


def _rounded(figure: float | None) -> float | None:
    return None if figure is None else round(figure, 4)


def _memory() -> float:
    """Return the resident memory of this process, MB (proc(5), `statm`)."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6
