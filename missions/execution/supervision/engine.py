"""The engine process of a run: `python -m missions.execution.supervision.engine`.

It owns the robots. Its standard input is the request of the supervisor, as JSON. SIGINT and SIGTERM
end the run as interrupted; the report is still written. SIGUSR1 writes the stacks of all threads to
standard error, also during a call that never returns.
"""

from __future__ import annotations

import errno
import faulthandler
import json
import os
import signal
import sys
import traceback
from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack, suppress
from dataclasses import asdict, replace
from pathlib import Path
from tempfile import gettempdir
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy

from missions.execution.prepare import RunOptions, prepare
from missions.execution.progress import ProgressLines
from missions.execution.records.run_folders import RUNS, reserved_suffix
from missions.execution.report import INTERNAL_ERROR, WRONG_INPUT, Report, worst_of
from missions.execution.resources import find_mission
from missions.execution.run import Run, RunWatch
from missions.execution.running import execute
from missions.execution.shared_world import prepare_together, run_together
from missions.execution.supervision.heartbeat import Heartbeat, Phase, Request
from missions.execution.supervision.messages import Outbox
from stack.body import FASTEST_PACE, SLOWEST_PACE, pace_problem
from stack.errors import BodyError, Finding, InputError, TreepilotError
from stack.telemetry.records import Event
from stack.telemetry.sinks import Sink
from stack.types.printable import printable

NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)

VIEWER_WITHIN = 5.0
"""Wall seconds that the first step waits for the dashboard, so that it shows the mission begin."""


class Supervised(RunWatch, Sink):
    """Reports the progress of one run to the supervisor, and obeys its requests.

    It is a telemetry sink, for the names of the nodes, and the run's watch.
    """

    def __init__(self, heartbeat: Heartbeat, outbox: Outbox, request: Mapping[str, Any]) -> None:
        self._heartbeat, self._outbox = heartbeat, outbox
        self._on_hangup, self._supervisor = request["on_hangup"], request["supervisor"]
        self._patience = VIEWER_WITHIN if request["dashboard"] else 0.0
        self._tree, self._cell = heartbeat.add_tree()
        self._folder = ""

    def event(self, event: Event) -> None:
        """Tell the names of the nodes, also after a reload."""
        if event.kind == "tree":
            names = [
                f"{name} ({kind}, {where})" for _, _, kind, name, where in event.fields["rows"]
            ]
            self._heartbeat.set_names(self._tree, names)
        elif event.kind == "mission_ended":
            self._outbox.send("ended", folder=self._folder, how=event.text)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Tell that the records are being closed."""
        self._heartbeat.close_run()

    def compiles(self) -> None:
        """Tell that kernels are compiled; that takes long and nothing moves."""
        self._heartbeat.phase = Phase.COMPILING

    def prepared(self, draft: Report) -> None:
        """Tell which folder was created, and the report of a run that does not begin."""
        self._folder = draft.folder
        self._outbox.send("prepared", folder=draft.folder, draft=draft.plain())

    def built(self, run: Run) -> None:
        """Tell that the run is ready for its first step, and how to reach it."""
        run.engine.tree.execution.ticked = self._cell
        handle = run.handle
        self._outbox.send(
            "started", folder=str(run.folder or ""), draft=run.draft().plain(),
            handle=None if handle is None else asdict(handle),
        )  # fmt: skip
        run.await_viewer(self._patience)
        self._beat(run)
        self._heartbeat.phase = Phase.RUNNING

    def stepped(self, run: Run) -> None:
        """Tell that a step was made, and obey the supervisor."""
        self._beat(run)
        request = self._heartbeat.request
        if request is Request.CONTINUE_ALONE or run.state.is_over:
            return
        if request is Request.HUNG_UP or os.getppid() != self._supervisor:
            self._heartbeat.request = Request.CONTINUE_ALONE
            self._hang_up(run)

    def _beat(self, run: Run) -> None:
        runtime = run.engine.runtime
        self._heartbeat.beat(runtime.steps, runtime.parts.body.time, runtime.distance)

    def _hang_up(self, run: Run) -> None:
        """The terminal is gone: continue, stop the robot, or end the mission."""
        choice = self._on_hangup or ("continue" if run.engine.simulation is not None else "stop")
        if choice == "abort":
            run.interrupt("the terminal was closed")
        elif choice == "stop":
            run.pause("the terminal was closed")


def main() -> int:
    """Run the missions of the request and return the exit code."""
    request = json.loads(sys.stdin.buffer.read())
    faulthandler.enable()
    faulthandler.register(signal.SIGUSR1)
    caught: list[int] = []
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda received, _: caught.append(received))
    signal.signal(signal.SIGHUP, signal.SIG_IGN)
    heartbeat, outbox = Heartbeat(request["heartbeat"]), Outbox(request["outbox"])

    def supervised() -> Supervised:
        return Supervised(heartbeat, outbox, request)

    try:
        reports = _run(request, supervised, lambda: bool(caught))
    except BodyError as error:
        print(printable(f"robot failure: {error}"), file=sys.stderr)
        return INTERNAL_ERROR
    except TreepilotError as error:
        print(printable(str(error)), file=sys.stderr)
        return WRONG_INPUT
    except OSError as error:
        if error.errno in NO_SPACE:
            print(f"no space for temporary files in {gettempdir()}", file=sys.stderr)
            return WRONG_INPUT
        if error.filename is None:
            return _internal_error()
        print(printable(f"{error.filename!s:.200}: {error.strerror}"), file=sys.stderr)
        return WRONG_INPUT
    except Exception:
        return _internal_error()
    outbox.send("reports", reports=[report.plain() for report in reports])
    return worst_of([report.exit_code for report in reports])


def _internal_error() -> int:
    """Print the error that is being handled and return its exit code."""
    traceback.print_exc()
    print("internal error: a bug in treepilot, not in your mission", file=sys.stderr)
    return INTERNAL_ERROR


def _run(
    request: Mapping[str, Any], supervised: Callable[[], Supervised],
    interrupted: Callable[[], bool],
) -> list[Report]:  # fmt: skip
    """Run one mission, or several in one world.

    Raises:
        InputError: the input is wrong; nothing has moved.
    """
    settings, missions = request["options"], request["missions"]
    files = ("out", "replay", "mavlink_key")
    paths = {key: Path(settings[key]) for key in files if settings.get(key)}
    runs = RUNS.absolute()  # a plugin may change the working directory
    options = RunOptions(**{**settings, **paths, "speed": speed_factor(settings["speed"])})
    with ExitStack() as folders:
        if len(missions) == 1:
            plan = prepare(missions[0], options)
            _print_warnings(plan.mission.warnings)
            if options.out is None:
                stem = plan.mission.source.stem
                suffix = folders.enter_context(reserved_suffix([stem], runs))
                options = replace(options, out=runs / (stem + suffix))
            watch = supervised()
            return [execute(plan, options, [watch, _progress()], interrupted, watch=watch)]
        suffix = ""
        if options.out is None:
            stems = [find_mission(name).stem for name in missions]
            suffix = folders.enter_context(reserved_suffix(stems, runs))
            options = replace(options, out=runs)
        entries = []
        for entry in prepare_together(missions, options, suffix):
            _print_warnings(entry.plan.mission.warnings)
            watch = supervised()
            entries.append(replace(entry, sinks=[watch, _progress(entry.label)], watch=watch))
        return run_together(entries, interrupted)


def speed_factor(text: str) -> float:
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


def _progress(label: str = "") -> ProgressLines:
    """Return the sink that prints progress, with the mission's name if there are several."""
    before = f"{label}: " if label else ""

    def show(line: str) -> None:
        with suppress(OSError):  # nobody reads it, or there is no memory for it now
            print(f"{before}{line}", file=sys.stderr, flush=True)

    return ProgressLines(show)


def _print_warnings(warnings: Iterable[Finding]) -> None:
    for warning in warnings:
        print(printable(str(warning)), file=sys.stderr)


if __name__ == "__main__":
    code = main()
    with suppress(OSError):
        sys.stderr.flush()
    os._exit(code)  # at once, whatever threads a plugin has started
