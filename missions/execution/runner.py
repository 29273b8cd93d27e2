"""Run prepared missions to their ends. Every way to run a mission uses it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.report import Report
from missions.execution.run import Run
from robots.bodies import MakeBody
from stack.telemetry.records import Sink


def run_mission(
    mission: str | Path,
    options: RunOptions,
    sinks: Sequence[Sink] = (),
    interrupted: Callable[[], bool] = lambda: False,
    make_body: MakeBody | None = None,
) -> Report:
    """Prepare a mission and run it to its end in this process.

    Args:
        mission: a path, or the name of a shipped mission.
        options: seed, arguments, folder and other settings of the run.
        sinks: consumers of events and snapshots, in addition to those of the options.
        interrupted: called between steps; True ends the run as interrupted.
        make_body: makes the body; None: the choice of the options or of the robot file.

    Raises:
        InputError: the mission or a file it names has errors; nothing has moved.
    """
    return execute(prepare(mission, options), options, sinks, interrupted, make_body)


def execute(
    plan: PreparedMission,
    options: RunOptions,
    sinks: Sequence[Sink] = (),
    interrupted: Callable[[], bool] = lambda: False,
    make_body: MakeBody | None = None,
) -> Report:
    """Run a prepared mission to its end; in any case stop the robot and close the records."""
    run = Run(plan, options, sinks, make_body, interrupted)
    try:
        while not run.is_over:
            run.step()
            if interrupted():
                run.interrupt()
        return run.finish()
    finally:
        run.close()
