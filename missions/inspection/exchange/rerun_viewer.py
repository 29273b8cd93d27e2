"""Shows a run in rerun's viewer: a recording that is drawn once, or a live run."""

from __future__ import annotations

import os
import shlex
import signal
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from time import monotonic, sleep  # noqa: TID251 - waits for other programs

from missions.inspection.exchange.viewing import (
    DATA_PORT,
    WEB_ADDRESS,
    has_display,
    remedies,
    tunnel,
)
from missions.inspection.run_folders import is_live
from stack.errors import InputError, TelemetryError
from stack.telemetry.recorder import RunFolder
from stack.telemetry.snapshots.recording import SnapshotRecording

LOOPBACK = "127.0.0.1"

FOLLOW_PERIOD = 0.2
"""Wall seconds between two looks for what a live run has written."""

BEGINS_WITHIN = 120.0
"""Wall seconds that a live run gets to write its first snapshot; it may compile first."""

ANSWERS_WITHIN = 30.0
"""Wall seconds that a viewer gets to listen."""

ENDS_WITHIN = 2.0
"""Wall seconds that a viewer gets to end."""


def show(folder: Path, *, web: bool) -> None:
    """Show a run until the viewer is closed.

    Args:
        folder: of the run.
        web: serve a browser on this machine instead of opening a window.

    Raises:
        InputError: there is no display, the run has no snapshots, or the viewer does not start.
    """
    is_local = has_display(os.environ, sys.platform)
    live = is_live(folder)
    recording = None if live else drawn(folder)
    if not web and not is_local:
        raise InputError(remedies(folder, recording, os.environ))
    words = [*(["--serve-web"] if web else []), "--bind", LOOPBACK]
    where = _where(is_local) if web else ""
    if recording is not None:
        _become_viewer([*words, str(recording)], where)
    else:
        _show_live(folder, words, DATA_PORT if web else free_port(), where)


def drawn(folder: Path) -> Path:
    """Return the recording of a run for rerun; draw it if the run's snapshots are newer.

    The progress is shown on stderr if that is a terminal.

    Raises:
        InputError: the run has no snapshots, or the recording cannot be written.
    """
    from stack.telemetry.rerun.recorded import draw_recorded, is_current

    file = RunFolder(folder).recording
    if is_current(folder, file):
        return file
    try:
        draw_recorded(folder, file, _show_progress if sys.stderr.isatty() else _ignore)
    except OSError as error:
        raise InputError(f"cannot write {file}: {error.strerror}") from None
    print(f"{file}: drawn from the run's snapshots", file=sys.stderr)
    return file


def follow(folder: Path, url: str, is_open: Callable[[], bool]) -> None:
    """Send a run to a viewer until the run ends or the viewer is closed.

    Args:
        folder: of the run.
        url: of the viewer's server.
        is_open: whether the viewer runs.

    Raises:
        InputError: the run ended without a snapshot, or writes none, or its records are damaged.
        TelemetryError: the viewer runs, and does not take the run.
    """
    from stack.telemetry.rerun.recorded import RecordedDrawing
    from stack.telemetry.rerun.recording import ViewerOutput

    with (
        _begun(folder, is_open) as recording,
        closing(RecordedDrawing(recording, ViewerOutput(url))) as drawing,
    ):
        while is_open():
            goes_on = is_live(folder)  # before the last look
            recording.follow()
            try:
                drawing.draw()
            except TelemetryError:
                sleep(FOLLOW_PERIOD)  # a viewer that is being closed
                if is_open():
                    raise
            if recording.is_complete or not goes_on:
                return
            sleep(FOLLOW_PERIOD)


def _begun(folder: Path, is_open: Callable[[], bool]) -> SnapshotRecording:
    """Open the snapshots of a live run when there is one."""
    deadline = monotonic() + BEGINS_WITHIN
    while True:
        goes_on = is_live(folder) and is_open() and monotonic() < deadline
        try:
            return SnapshotRecording(folder)
        except InputError:
            if not goes_on:
                raise
        sleep(FOLLOW_PERIOD)


def _show_live(folder: Path, words: list[str], port: int, where: str) -> None:
    """Start a viewer, show a live run in it, and wait until it is closed."""
    if listens(port):
        raise InputError(f"port {port} is in use: close the other viewer")
    with _viewer([*words, "--port", str(port)]) as viewer:
        deadline = monotonic() + ANSWERS_WITHIN
        while not listens(port):
            if viewer.poll() is not None or monotonic() > deadline:
                raise InputError("rerun's viewer did not start")
            sleep(FOLLOW_PERIOD)
        print(where, end="", flush=True)
        follow(folder, f"rerun+http://{LOOPBACK}:{port}/proxy", lambda: viewer.poll() is None)
        if viewer.poll() is None:
            print("the run is over; close the viewer, or Ctrl+C", file=sys.stderr)
            viewer.wait()


@contextmanager
def _viewer(words: list[str]) -> Iterator[subprocess.Popen[bytes]]:
    """Run a viewer; a signal to this process ends it too."""
    program = viewer_program()
    print(shlex.join(["rerun", *words]), file=sys.stderr)
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        viewer = subprocess.Popen([program, *words], stdin=subprocess.DEVNULL)
    except OSError as error:
        raise InputError(f"cannot start {program}: {error.strerror}") from None
    try:
        with suppress(KeyboardInterrupt):
            yield viewer
    finally:
        signal.signal(signal.SIGTERM, before)
        viewer.terminate()
        try:
            viewer.wait(ENDS_WITHIN)
        except subprocess.TimeoutExpired:
            viewer.kill()
            viewer.wait()


def _become_viewer(words: list[str], where: str) -> None:
    """Replace this process by rerun's viewer."""
    program = viewer_program()
    print(shlex.join(["rerun", *words]))
    print(where, end="", flush=True)
    try:
        os.execv(program, [program, *words])
    except OSError as error:
        raise InputError(f"cannot start {program}: {error.strerror}") from None


def _where(is_local: bool) -> str:
    """How to reach the viewer in a browser."""
    led = "" if is_local else f"on your computer: {tunnel(os.environ)}\n"
    return f"{led}open {WEB_ADDRESS}\n"


def viewer_program() -> str:
    """The viewer itself: the script `rerun` starts it as a child, which signals do not reach.

    Raises:
        InputError: rerun is not installed.
    """
    found = find_spec("rerun_cli")
    if found is None or found.origin is None:
        raise InputError("rerun's viewer is not installed: pip install rerun-sdk")
    return str(Path(found.origin).with_name("rerun"))


def free_port() -> int:
    """A port of the loopback device that nobody listens on: each viewer has its own."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])


def listens(port: int) -> bool:
    """Whether a program listens on a port of the loopback device."""
    with socket.socket() as probe:
        probe.settimeout(1.0)
        return probe.connect_ex((LOOPBACK, port)) == 0


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def _show_progress(share: float) -> None:
    end = "\r\x1b[K" if share >= 1.0 else ""
    print(f"\rdrawing the recording: {share:4.0%}{end}", end="", file=sys.stderr, flush=True)


def _ignore(share: float) -> None:
    """Show no progress: nobody watches."""
