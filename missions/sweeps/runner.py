"""Runs of a sweep in several processes: journal, table, and when to stop."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from io import RawIOBase
from pathlib import Path
from time import perf_counter

from missions.bench.processes import ProcessEnded, results
from missions.execution.resources import versions
from missions.inspection.run_folders import is_run_folder
from missions.sweeps.checking import CheckedSweep
from missions.sweeps.claims import Claim, Decision
from missions.sweeps.design import RunDescription
from missions.sweeps.row import CRASHED, HUNG, KILLED, SweepRow
from missions.sweeps.sweep import SCENE
from missions.sweeps.table import SweepFolder, place_of
from missions.sweeps.worker import SweepInputs, start_worker

RUNS_PER_PROCESS = 200
"""A process is replaced after so many runs: each leaves some memory behind (docs/sweeps.md)."""

SCENES_PER_PROCESS = 40
"""The same if robot or world change: PyBullet keeps the meshes of each, about 10 MB a world."""

TABLE_PERIOD = 60.0
"""Wall seconds between two writes of the table."""

SILENCE = 300.0
"""Seconds that a process may compute, or do nothing, without a step; then its run counts as hung.
The kernels of a fresh installation compile in less."""

Follow = Callable[[list[SweepRow]], None]
"""Gets all rows so far: before the first run, after each one, and at times in between."""


@dataclass(frozen=True)
class ExecutionSettings:
    """How a sweep is run; its results do not depend on it.

    Attributes:
        jobs: processes.
        until: claim that ends the sweep once it is decided.
        silence: seconds computed, or idle, without a step after which a run counts as hung.
        cluster: address of a Dask scheduler, whose workers make the runs; empty: this machine's.
        check: called at times; raises KeyboardInterrupt to end the sweep.
    """

    jobs: int = 1
    until: Claim | None = None
    silence: float = SILENCE
    cluster: str = ""
    check: Callable[[], None] = lambda: None


def run_sweep(
    checked: CheckedSweep, folder: SweepFolder, execution: ExecutionSettings, follow: Follow
) -> list[SweepRow]:
    """Make the runs that the folder lacks; return all rows, in the order of the runs.

    However it ends, the rows of the runs that are over are in the journal.

    Raises:
        InputError: the folder has another sweep, or cannot be written.
    """
    with folder.open_journal() as journal:
        rows = folder.begin(checked)
        follow(rows)
        try:
            _fill(journal, rows, checked, folder, execution, follow)
        finally:
            folder.tabulate(rows, checked.sweep)
    return sorted(rows, key=lambda row: row.number)


def _fill(  # noqa: PLR0913 - what the runs, their rows and their end need
    journal: RawIOBase, rows: list[SweepRow], checked: CheckedSweep,
    folder: SweepFolder, execution: ExecutionSettings, follow: Follow,
) -> None:  # fmt: skip
    """Append the rows of missing runs, until all are there or the claim is decided."""
    decision = None if execution.until is None else Decision(execution.until, rows)
    is_decided = decision is not None and decision.verdict is not None
    if is_decided or len(rows) == checked.sweep.runs:
        return
    inputs = SweepInputs(checked.sweep, folder.runs, checked.paths)
    made = made_rows(inputs, _missing(checked, rows), execution, lambda: follow(rows))
    tabulated = perf_counter()
    with closing(made):
        for row in made:
            folder.write(journal, row)
            rows.append(row)
            follow(rows)
            if decision is not None:
                decision.add(row)
                if decision.verdict is not None:
                    return
            if perf_counter() - tabulated >= TABLE_PERIOD:
                folder.tabulate(rows, checked.sweep)
                tabulated = perf_counter()


def made_rows(
    inputs: SweepInputs, runs: Iterable[RunDescription], execution: ExecutionSettings,
    on_poll: Callable[[], None] = lambda: None,
) -> Generator[SweepRow, None, None]:  # fmt: skip
    """Make runs in the processes of this machine, or of a cluster; yield rows as runs finish.

    Closing the generator ends the processes; a cluster's cancel their runs.

    Args:
        inputs: of all runs.
        runs: each is taken when a process is free, after the rows so far: it may depend on them.
        execution: number of processes and their limits.
        on_poll: called at times.
    """

    def polled() -> None:
        execution.check()
        on_poll()

    if execution.cluster:
        from missions.sweeps.cluster import cluster_rows  # imports Dask

        yield from cluster_rows(execution.cluster, inputs, runs, execution.silence, polled)
        return
    several = any(factor.name in SCENE for factor in inputs.sweep.factors)
    made = results(
        partial(start_worker, inputs), runs, execution.jobs,
        RUNS_PER_PROCESS if not several else SCENES_PER_PROCESS,
        silence=execution.silence, on_poll=polled,
    )  # fmt: skip
    with closing(made):  # type: ignore[type-var]
        for run, result in made:
            yield _row(run, result, inputs.runs)


def _missing(checked: CheckedSweep, rows: list[SweepRow]) -> Iterator[RunDescription]:
    done = {row.number for row in rows}
    return (run for run in checked.sweep.descriptions() if run.number not in done)


def _row(
    run: RunDescription, result: SweepRow | ProcessEnded | BaseException, folders: Path
) -> SweepRow:
    """Return the row of a run; of one whose process has ended, with the records up to its end."""
    if isinstance(result, SweepRow):
        return result
    if isinstance(result, BaseException):
        raise result
    outcome = HUNG if result.hung else KILLED if result.killed else CRASHED
    row = SweepRow.without_figures(run, outcome, result.reason, versions())
    place = place_of(folders, run.number)
    kept = next(filter(is_run_folder, (place, *place.glob("*"))), None)  # see RunMaker._folder
    return row if kept is None else replace(row, folder=str(kept.relative_to(folders.parent)))
