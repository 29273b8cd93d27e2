"""Start runs: in this process without a dashboard, in an engine process with one."""

from __future__ import annotations

import json as json_format
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from pathlib import Path
from time import monotonic, sleep  # noqa: TID251 - waiting for another process
from typing import IO, TextIO

from missions.execution.prepare import RunOptions, prepare
from missions.execution.progress import ProgressLines
from missions.execution.report import Report
from missions.execution.resources import find_mission
from missions.execution.run import execute
from missions.execution.shared_world import prepare_together, run_together
from stack.body import FASTEST_PACE, SLOWEST_PACE, pace_problem
from stack.errors import InputError
from stack.telemetry.rendezvous import RunHandle, find_run, live_runs

WRONG_INPUT, ENGINE_LOST = 2, 3
BY_SEVERITY = (3, 130, 1)
"""Exit codes of several missions: the first of these that one of them has."""

START_TIMEOUT, STOP_TIMEOUT = 60.0, 20.0
"""Wall seconds to wait for an engine to answer or to write, and for its end after a stop."""


@dataclass(frozen=True)
class LaunchOptions:
    """Command-line options of `treepilot run`."""

    missions: tuple[str, ...]
    headless: bool = True
    json: bool = False
    speed: str = ""
    seed: int = 0
    arguments: dict[str, str] = field(default_factory=dict)
    robot: str | None = None
    world: str | None = None
    start: str | None = None
    out: Path | None = None
    rerun: bool = True
    mavlink: str | None = None
    camera: str = "asked"
    watch: bool = False
    breakpoints: tuple[str, ...] = ()
    forced: dict[str, str] = field(default_factory=dict)
    parameters: dict[str, str] = field(default_factory=dict)
    body: str = ""
    replay: Path | None = None
    record: tuple[str, ...] = ()

    @property
    def mission(self) -> str:
        """The only, or the first, mission."""
        return self.missions[0]

    def run_options(self) -> RunOptions:
        """Return the options of the engine, with the run folder and speed resolved."""
        return RunOptions(
            seed=self.seed, arguments=self.arguments, robot=self.robot, world=self.world,
            start=self.start, out=self._folder(),
            speed=_speed(self.speed or ("max" if self.headless else "1")), rerun=self.rerun,
            mavlink=self.mavlink, camera=self.camera, watch=self.watch,
            breakpoints=self.breakpoints, forced=self.forced,
            parameters=self.parameters, body=self.body, replay=self.replay, record=self.record,
        )  # fmt: skip

    def _folder(self) -> Path | None:
        """The run folder; of several missions their parent, None for the default."""
        if self.out is not None or len(self.missions) > 1:
            return self.out
        return default_folder(self.mission)


def launch(options: LaunchOptions) -> int:
    """Run missions, one with or without a dashboard, several without; return the exit code."""
    if len(options.missions) > 1:
        return _run_several(options)
    return _run_here(options) if options.headless else _run_with_dashboard(options)


def default_folder(mission: str) -> Path:
    """Return `runs/<mission>-<date>-<time>` in the current folder, numbered if it exists."""
    return Path("runs") / (find_mission(mission).stem + free_suffix([mission]))


def free_suffix(names: Sequence[str]) -> str:
    """Return `-<date>-<time>`, numbered if one of the missions has a run folder of that name."""
    stamp, count = datetime.now().strftime("-%Y%m%d-%H%M%S"), 1
    suffix = stamp
    while any((Path("runs") / (find_mission(name).stem + suffix)).exists() for name in names):
        count += 1
        suffix = f"{stamp}-{count}"
    return suffix


def watch_run(name: str) -> int:
    """Attach the dashboard to a live run; an empty name is the newest run."""
    run = find_run(name)
    outcome = _dashboard(run)
    if outcome == "abort":
        print(f"aborted {run.run_id}", file=sys.stderr)
    return 0


def _speed(text: str) -> float:
    """Return the speed factor; 0 for "max"."""
    if text == "max":
        return 0.0
    try:
        factor = float(text)
    except ValueError:
        factor = -1.0
    if factor == 0.0 or pace_problem(factor):
        allowed = f"{SLOWEST_PACE:g} to {FASTEST_PACE:g}"
        raise InputError(f"--speed {text}: expected max, or a number from {allowed}")
    return factor


SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def _interrupts(forward: Callable[[], None] = lambda: None) -> Iterator[list[int]]:
    """Collect signals in a list and forward them; a second SIGINT raises KeyboardInterrupt."""
    caught: list[int] = []

    def note(number: int, _: object) -> None:
        caught.append(number)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        forward()

    before = {number: signal.signal(number, note) for number in SIGNALS}
    try:
        yield caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run_here(options: LaunchOptions) -> int:
    run_options = options.run_options()
    with _clean_stdout(options.json) as out:
        plan = prepare(options.mission, run_options)
        for warning in plan.mission.warnings:
            print(warning, file=sys.stderr)
        lines = ProgressLines(lambda line: print(line, file=sys.stderr))
        with _interrupts() as caught:
            report = execute(
                plan, run_options, [] if options.json else [lines], lambda: bool(caught)
            )
        print(report.to_json() if options.json else report.summary(), file=out)
    return report.exit_code


def _run_several(options: LaunchOptions) -> int:
    """Run several missions in one world, in this process."""
    settings, suffix = options.run_options(), ""
    if settings.out is None:
        suffix = free_suffix(options.missions)
        settings = replace(settings, out=Path("runs"))
    with _clean_stdout(options.json) as out:
        entries = prepare_together(options.missions, settings, suffix)
        for entry in entries:
            for warning in entry.plan.mission.warnings:
                print(warning, file=sys.stderr)
        if not options.json:
            entries = [replace(entry, sinks=[_labelled_lines(entry.label)]) for entry in entries]
        with _interrupts() as caught:
            reports = run_together(entries, lambda: bool(caught))
        if options.json:
            print(
                json_format.dumps(
                    [report.plain() for report in reports], indent=2, allow_nan=False
                ),
                file=out,
            )
        else:
            print("\n\n".join(report.summary() for report in reports), file=out)
    codes = [report.exit_code for report in reports]
    return next((code for code in BY_SEVERITY if code in codes), 0)


def _labelled_lines(label: str) -> ProgressLines:
    return ProgressLines(lambda line: print(f"{label}: {line}", file=sys.stderr))


@contextmanager
def _clean_stdout(wanted: bool) -> Iterator[TextIO]:
    """Yield the real stdout for the report; all other output, also of libraries, goes to stderr."""
    if not wanted:
        yield sys.stdout
        return
    sys.stdout.flush()
    kept = os.dup(1)
    os.dup2(2, 1)
    try:
        with os.fdopen(os.dup(kept), "w", encoding="utf-8") as out:
            yield out
    finally:
        sys.stdout.flush()
        os.dup2(kept, 1)
        os.close(kept)


def _run_with_dashboard(options: LaunchOptions) -> int:
    """Start the engine in its own session; show its dashboard, forward signals, await its end."""
    run_options = options.run_options()
    prepare(options.mission, run_options)  # findings are printed before the screen changes
    assert run_options.out is not None
    with tempfile.TemporaryFile() as errors:
        engine = _spawn_engine(options.mission, run_options, errors)
        with _interrupts(lambda: _interrupt(engine)) as caught:
            run = _await_engine(engine, run_options.out.name, caught, errors)
            outcome = _dashboard(run, lambda: bool(caught)) if run is not None else "over"
            if outcome == "leave" and engine.poll() is None:
                print(f"the mission continues; attach with: treepilot watch {run_options.out.name}")
                return 0
            if outcome == "interrupt":
                _interrupt(engine)
            return _await_end(engine, run_options.out, errors)


def _interrupt(engine: subprocess.Popen[bytes]) -> None:
    if engine.poll() is None:
        engine.send_signal(signal.SIGINT)


def _spawn_engine(mission: str, options: RunOptions, errors: IO[bytes]) -> subprocess.Popen[bytes]:
    """Start the engine in its own session, with a file as stderr: a full pipe would block it."""
    settings = {**asdict(options), "out": str(options.out)}
    message = json_format.dumps({"mission": mission, "options": settings}, default=str)
    return subprocess.Popen(
        [sys.executable, "-m", "missions.execution.engine", message],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=errors,
        start_new_session=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip


def _await_engine(
    engine: subprocess.Popen[bytes], run_id: str, caught: list[int], errors: IO[bytes]
) -> RunHandle | None:
    """Wait until the engine's telemetry answers; meanwhile show what the engine writes to stderr.

    It compiles kernels before it opens the telemetry, with a line for each part. So the time limit
    counts from its last output.
    """
    shown, deadline = 0, monotonic() + START_TIMEOUT
    while monotonic() < deadline and engine.poll() is None and not caught:
        for run in live_runs():
            if run.run_id == run_id:
                return run
        output = os.pread(errors.fileno(), 1 << 16, shown)
        if output:
            print(output.decode(errors="replace"), end="", file=sys.stderr, flush=True)
            shown, deadline = shown + len(output), monotonic() + START_TIMEOUT
        sleep(0.02)
    return None


def _dashboard(run: RunHandle, interrupted: Callable[[], bool] | None = None) -> str:
    """Show a run until the operator leaves: over | leave | abort | interrupt | lost.

    Args:
        run: the run to watch.
        interrupted: whether a signal arrived; set by the process that started the run, so that
            ctrl+c ends it.
    """
    from stack.telemetry.client import TelemetryClient
    from tui.app import Dashboard

    client = TelemetryClient(run.address)
    try:
        return Dashboard(client, interrupted=interrupted).run() or "over"
    finally:
        client.close()


def _await_end(engine: subprocess.Popen[bytes], folder: Path, errors: IO[bytes]) -> int:
    try:
        engine.wait(timeout=STOP_TIMEOUT)
    except subprocess.TimeoutExpired:
        engine.kill()
        engine.wait()
    report_file = folder / "report.json"
    if report_file.exists():
        report = Report(**json_format.loads(report_file.read_text("utf-8")))
        print(report.summary())
        return report.exit_code
    errors.seek(0)
    message = errors.read().decode(errors="replace").strip() or "no message"
    if engine.returncode == WRONG_INPUT:
        print(message, file=sys.stderr)
        return WRONG_INPUT
    print(
        f"the engine stopped unexpectedly: {message}\nrecords so far are in {folder}",
        file=sys.stderr,
    )
    return ENGINE_LOST
