"""Runs of missions to their ends: of one robot, or of several in one world."""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.report import Report
from missions.execution.run import Run, RunWatch
from robots.bodies import MakeBody
from stack.telemetry.sinks import Sink

COLLECT_AFTER = 50_000
"""Objects after which Python searches for cyclic garbage during a run. A step makes thousands of
objects that end with it, and hardly any cycles; the usual 700 cost 6 % of the processor time."""


def run_mission(
    mission: str | Path,
    options: RunOptions,
    sinks: Sequence[Sink] = (),
    make_body: MakeBody | None = None,
) -> Report:
    """Prepare a mission and run it to its end in this process.

    Args:
        mission: a path, or the name of a shipped mission.
        options: seed, arguments, folder and other settings of the run.
        sinks: consumers of events and snapshots, in addition to those of the options.
        make_body: makes the body; None: the choice of the options or of the robot file.

    Raises:
        InputError: the mission or a file it names has errors; nothing has moved.
    """
    return execute(prepare(mission, options), options, sinks, make_body=make_body)


def execute(  # noqa: PLR0913 - the optional ones by keyword
    plan: PreparedMission,
    options: RunOptions,
    sinks: Sequence[Sink] = (),
    interrupted: Callable[[], bool] = lambda: False,
    make_body: MakeBody | None = None,
    watch: RunWatch | None = None,
) -> Report:
    """Run a prepared mission to its end; in any case stop the robot and close the records."""
    with rare_collections():
        run = Run(plan, options, sinks, make_body, interrupted, watch)
        try:
            run_in_turns([run], interrupted)
        finally:
            run.close()
        return run.report


def run_in_turns(runs: Sequence[Run], interrupted: Callable[[], bool] = lambda: False) -> None:
    """Step runs in turn to their ends; finish and close each as soon as it is over.

    A run that cannot step yet serves its operators meanwhile.

    Args:
        runs: of one robot, or of several in one world.
        interrupted: called between steps; True ends all runs as interrupted.
    """
    remaining = list(runs)
    while remaining:
        for run in tuple(remaining):
            if not run.is_due:
                run.serve()
                continue
            if run.is_over:
                run.finish()
                run.close()
                remaining.remove(run)
                continue
            if run.is_ready():
                run.step()
            else:
                run.serve()
            if interrupted():
                run.interrupt()


@contextmanager
def rare_collections() -> Iterator[None]:
    """Let Python search for cyclic garbage more rarely, as long as a run takes."""
    before = gc.get_threshold()
    gc.set_threshold(max(before[0], COLLECT_AFTER), *before[1:])
    try:
        yield
    finally:
        gc.set_threshold(*before)
