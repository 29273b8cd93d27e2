"""`treepilot run`: supervise an engine, with its dashboard or with lines of progress."""

from __future__ import annotations

import errno
import json as json_format
import os
import signal
import sys
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from missions.execution.report import INTERNAL_ERROR, INTERRUPTED, WRONG_INPUT, Report, worst_of
from missions.execution.supervision.heartbeat import Phase
from missions.execution.supervision.lost_engine import end_of, lost_reports
from missions.execution.supervision.run_viewer import RunViewer
from missions.execution.supervision.supervisor import POLL, Supervisor
from missions.execution.supervision.viewer import Viewer
from missions.run_options import RunOptions

HANG_TIMEOUT = 60.0
"""Wall seconds without a step after which an engine is killed, if not chosen otherwise."""


@dataclass(frozen=True)
class LaunchOptions:
    """Command-line options of `treepilot run`.

    Attributes:
        run: options of each run; `speed` is read from the text below.
        speed: simulated seconds per wall second, or `max`; empty: 1 in the dashboard, else max.
        on_hangup: continue | stop | abort when the terminal is closed; empty: continue in a
            simulation, stop a real robot.
        hang_timeout: wall seconds without a step after which the engine is killed; 0: never.
        view: show each run live in rerun's viewer.
        is_demo: whether the dashboard says what the robot does, and what to press.
    """

    missions: tuple[str, ...]
    run: RunOptions = field(default_factory=RunOptions)
    headless: bool = True
    json: bool = False
    speed: str = ""
    on_hangup: str = ""
    hang_timeout: float = HANG_TIMEOUT
    view: bool = False
    is_demo: bool = False

    def request(self) -> dict[str, Any]:
        """Return what the engine is asked to do."""
        speed = self.speed or ("max" if self.headless else "1")
        return {
            "missions": self.missions, "options": {**asdict(self.run), "speed": speed},
            "on_hangup": self.on_hangup, "dashboard": not self.headless,
        }  # fmt: skip


def launch(options: LaunchOptions) -> int:
    """Run missions, one with or without a dashboard, several without; return the exit code."""
    with _signals(with_dashboard=not options.headless) as caught:
        supervisor = Supervisor(
            options.request(), options.hang_timeout, caught, show=not options.json
        )
        viewers: list[RunViewer] = []
        try:
            if options.view:
                viewers += _viewers_of(supervisor, len(options.missions))
            if not options.headless and not _watch(supervisor, is_demo=options.is_demo):
                return 0
            supervisor.wait(lambda: any(viewer.has_failed for viewer in viewers))
            for viewer in viewers:
                viewer.tell()
            supervisor.wait()
            if supervisor.hung_up and supervisor.engine.poll() is None:
                return INTERRUPTED
            return _print_result(supervisor, options)
        except BaseException:
            supervisor.end_now("the supervisor failed")
            raise
        finally:
            for viewer in viewers:
                viewer.close()
            supervisor.close()
            _flush_streams()


def _viewers_of(supervisor: Supervisor, count: int) -> list[RunViewer]:
    """Open a viewer for each run once all have started."""
    supervisor.wait(lambda: len(supervisor.started) == count)
    folders = [Path(started["folder"]) for started in supervisor.started if started["folder"]]
    return [RunViewer(folder) for folder in folders]


def _flush_streams() -> None:
    """Write what is left; what a terminal that is gone does not take must not change the exit code.

    The interpreter flushes once more when it ends, and would exit with 120.
    """
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except OSError:
            with open(os.devnull, "wb") as nowhere, suppress(OSError):
                os.dup2(nowhere.fileno(), stream.fileno())


def _watch(supervisor: Supervisor, *, is_demo: bool) -> bool:
    """Show the dashboard; return False if the operator leaves and the mission continues."""
    supervisor.wait(lambda: bool(supervisor.started))
    handle = supervisor.started[0]["handle"] if supervisor.started else None
    if handle is None or supervisor.hung_up:
        return True
    supervisor.output.hide()
    viewer = Viewer(handle, owns_run=True, is_demo=is_demo)
    while viewer.is_open and not supervisor.hung_up and not supervisor.signalled:
        supervisor.poll()
        viewer.wait(POLL)
    outcome = viewer.close()
    supervisor.poll()  # a signal to both processes may have reached the dashboard first
    if outcome == "hangup":
        supervisor.hang_up()
    if supervisor.hung_up or supervisor.signalled:
        return True
    attach = f"treepilot watch {supervisor.started[0]['folder'] or handle['run_id']}"
    if outcome == "interrupt":
        supervisor.interrupt()
    elif outcome == "leave" and supervisor.engine.poll() is None:
        supervisor.leave()
        print(f"the mission continues; attach with: {attach}")
        return False
    elif outcome in ("crashed", "terminated") and supervisor.engine.poll() is None:
        what = f"the dashboard crashed: {viewer.trouble}"
        if outcome == "terminated":
            what = "the dashboard was ended by a signal"
        supervisor.log(f"{what}\n{viewer.traceback}")
        print(what, file=sys.stderr)
        print(f"the mission continues; attach again with: {attach}", file=sys.stderr)
        supervisor.output.show()
    return True


def _print_result(supervisor: Supervisor, options: LaunchOptions) -> int:
    """Print the reports, or what is known about an engine that sent none; return the exit code."""
    reports = [Report(**values) for values in supervisor.reports]
    supervisor.output.finish()
    code = supervisor.engine.returncode
    if not reports:
        if not (supervisor.killed or supervisor.started) and code in (WRONG_INPUT, INTERNAL_ERROR):
            supervisor.output.show_all()
            return code
        reason = end_of(supervisor)
        if supervisor.phase in (Phase.STARTING, Phase.COMPILING) and supervisor.stopping:
            lost_reports(supervisor, f"{reason}; nothing has moved", "interrupted")
            print(f"{reason}; nothing has moved", file=sys.stderr)
            return INTERRUPTED
        reports = lost_reports(supervisor, reason)
        if not supervisor.started:
            supervisor.output.show_all()
        if not reports:
            print(f"{reason}; nothing has moved", file=sys.stderr)
            return INTERNAL_ERROR
    codes = [report.exit_code for report in reports]
    try:
        _print(reports, options)
    except OSError as error:
        if error.errno not in (errno.EPIPE, errno.EIO):  # nobody reads it, the terminal is gone
            print(f"cannot print the report: {error.strerror}", file=sys.stderr)
            codes.append(INTERNAL_ERROR)
    return worst_of(codes)


def _print(reports: Sequence[Report], options: LaunchOptions) -> None:
    if options.json:
        plain = [report.plain() for report in reports]
        shown = plain if len(options.missions) > 1 else plain[0]
        text = json_format.dumps(shown, indent=2, allow_nan=False, ensure_ascii=False)
        print(text, flush=True)
    else:
        print("\n\n".join(report.summary() for report in reports), flush=True)


@contextmanager
def _signals(*, with_dashboard: bool) -> Iterator[deque[int]]:
    """Collect signals for the supervisor, which acts on them; a dashboard has no ctrl+z."""
    caught: deque[int] = deque()
    wanted = [signal.SIGINT, signal.SIGTERM]
    if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup
        wanted.append(signal.SIGHUP)
    if not with_dashboard:
        wanted.append(signal.SIGTSTP)
    before = {
        number: signal.signal(number, lambda received, _: caught.append(received))
        for number in wanted
    }
    try:
        yield caught
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
