"""Run a prepared mission to its end and write the report. Every way to run a mission uses it."""

from __future__ import annotations

import resource
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path
from time import perf_counter

from missions.execution.build import Engine, build, run_info
from missions.execution.milestones import Milestones
from missions.execution.prepare import PreparedMission, RunOptions, prepare
from missions.execution.report import Report
from missions.execution.report_builder import compose_report
from missions.execution.warm_up import warm_up
from robots.bodies import MakeBody
from stack.errors import BodyError, InputError
from stack.runtime.snapshots import compose_snapshot
from stack.telemetry.hub import Telemetry
from stack.telemetry.recorder import Recorder, RunFolder
from stack.telemetry.records import MissionState, Sink
from stack.telemetry.sensor_log import read_about

MAX_SIMULATED_SECONDS = 24 * 3600.0
"""A mission that runs longer is ended as a failure."""


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
    began = perf_counter()
    if options.record and options.out is None:
        raise InputError("`record` needs a run folder: set `out`")
    options = _as_recorded(plan, options)
    network_sinks = _network_sinks(options)  # refuses a bad address before anything is written
    folder = RunFolder.create(options.out, plan.text) if options.out is not None else None
    run_id = folder.path.name if folder is not None else default_run_name(plan)
    info = run_info(plan, run_id, options.seed)
    milestones = Milestones()
    own = [milestones] if folder is None else [milestones, Recorder(folder)]
    log = folder.log if folder is not None else _discard
    log(f"{info.title}: {info.robot} in {info.world}, seed {info.seed}")
    warm_up(plan, options, partial(_show, log), interrupted)  # before a dashboard can open the run
    telemetry = Telemetry(info, [*own, *sinks, *network_sinks], log)
    report: Report | None = None
    engine: Engine | None = None
    try:
        engine = build(plan, options, telemetry, folder, make_body)
        if options.watch:
            from missions.execution.reload import Reloader

            engine.between_steps = Reloader(engine, plan, options, folder).poll
        first_tick, loop_began = _run(engine, options, folder, interrupted, log)
        report = compose_report(
            plan, options, engine,
            wall_seconds=perf_counter() - loop_began, first_tick=first_tick - began,
            peak_memory_mb=resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0,
            folder=folder, relocalisations=milestones.relocalisations,
        )  # fmt: skip
        log(report.summary())
        return report
    finally:
        _close(telemetry, engine, report)


def _close(telemetry: Telemetry, engine: Engine | None, report: Report | None) -> None:
    """Send the last snapshot and the report to every sink, then close the navigator and body."""
    if engine is None:
        telemetry.close(None)
        return
    try:
        final = report.plain() if report is not None else None
        telemetry.close(final, lambda: compose_snapshot(engine.runtime))
    finally:
        engine.runtime.parts.navigator.close()
        engine.body.close()
        if engine.sensor_log is not None:
            engine.sensor_log.close()


def _as_recorded(plan: PreparedMission, options: RunOptions) -> RunOptions:
    """Return the options with the seed of the recording that is replayed.

    Raises:
        InputError: the recording is of another robot.
    """
    if options.replay is None:
        return options
    about = read_about(options.replay)
    if about.get("robot") != plan.robot.name:
        raise InputError(
            f"{options.replay} was recorded with the robot {about.get('robot')!r}, this mission"
            f" has {plan.robot.name!r}; choose it with --robot"
        )
    seed = about.get("seed", "")
    if not seed.isdecimal():
        raise InputError(f"{options.replay}: the seed {seed!r} in its metadata is not a number")
    return replace(options, seed=int(seed))


def default_run_name(plan: PreparedMission) -> str:
    """Return `<mission>-<date>-<time>`, the name of the run for folders and `watch`."""
    now = datetime.now().strftime("%Y%m%d-%H%M%S")
    return f"{plan.mission.source.stem}-{now}"


def _run(
    engine: Engine,
    options: RunOptions,
    folder: RunFolder | None,
    interrupted: Callable[[], bool],
    log: Callable[[str], None],
) -> tuple[float, float]:
    """Step until the mission is over; return the wall times of the first tick and loop start."""
    runtime = engine.runtime
    loop_began = perf_counter()
    first_tick = 0.0
    try:
        while not runtime.state.is_over:
            engine.between_steps()
            runtime.step()
            if not first_tick:
                first_tick = perf_counter()
                _add_late_sinks(engine, options, folder)
            if interrupted():
                runtime.end(MissionState.INTERRUPTED, "stopped by a signal")
            elif engine.body.has_ended:
                runtime.end(MissionState.INTERRUPTED, "the recording is over")
            elif engine.body.time > MAX_SIMULATED_SECONDS:
                runtime.end(MissionState.FAILURE, "TIMED_OUT: ran for 24 hours of robot time")
        runtime.stand_still()
    except BodyError as error:
        runtime.end(MissionState.ERROR, f"robot failed: {error}")
    except Exception as error:
        log(traceback.format_exc())
        runtime.end(MissionState.ERROR, f"{type(error).__name__}: {error}")
        with suppress(Exception):
            runtime.stand_still()
    return first_tick or perf_counter(), loop_began


def _network_sinks(options: RunOptions) -> list[Sink]:
    sinks: list[Sink] = []
    if options.mavlink:
        from stack.telemetry.mavlink_sink import MavlinkSink

        sinks.append(MavlinkSink(options.mavlink))
    if options.serve:
        from stack.telemetry.server import TelemetryServer

        sinks.append(TelemetryServer())
    return sinks


def _add_late_sinks(engine: Engine, options: RunOptions, folder: RunFolder | None) -> None:
    """Attach rerun only after the first tick: importing it takes half a second."""
    if options.rerun and folder is not None:
        from stack.telemetry.rerun_sink import RerunSink

        engine.telemetry.attach(RerunSink(folder.path / "mission.rrd"))


def _show(log: Callable[[str], None], line: str) -> None:
    """Write a line to the run's log and to stderr, where also a caller's notebook shows it."""
    log(line)
    print(line, file=sys.stderr, flush=True)


def _discard(text: str) -> None:
    """Drop a log line: there is no run folder."""
