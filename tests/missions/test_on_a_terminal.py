"""`treepilot run` on a terminal: the dashboard opens, an engine is its child, keys work.

The terminal is a real pseudo-terminal and the processes are those that `make run` starts.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import termios
from collections.abc import Callable, Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from threading import Thread

import pytest

from stack.telemetry.client import TelemetryClient
from stack.telemetry.records import MissionState
from stack.telemetry.rendezvous import RunHandle, live_runs
from tests.missions.execution.test_engine import (
    PATIENCE,
    ROOT,
    on_hangup,
    order,
    state_becomes,
    until,
)
from tests.tui.terminal_screen import TerminalScreen

pytestmark = pytest.mark.slow

ESCAPES = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|[PX^_\]].*?(?:\x1b\\|\x07)|[ -/]*[0-~])", re.S)
LINES, COLUMNS = 40, 140
ALTERNATE_SCREEN, MAIN_SCREEN = "\x1b[?1049h", "\x1b[?1049l"
END_OF_FRAME = "\x1b[?2026l"


class Terminal:
    """A pseudo-terminal with `treepilot` in it: what it has written, and keys for it."""

    def __init__(self, words: list[str], folder: Path) -> None:
        self.folder, self._received = folder, bytearray()
        self._ours, theirs = os.openpty()
        termios.tcsetwinsize(theirs, (LINES, COLUMNS))
        self.process = subprocess.Popen(
            [sys.executable, "-m", "missions.cli.app", *words, "--out", str(folder)],
            stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True, cwd=ROOT,
            preexec_fn=on_hangup(),
            env={**os.environ, "TERM": "xterm-256color", "COLUMNS": "", "LINES": ""},
        )  # fmt: skip
        os.close(theirs)
        self._reader = Thread(target=self._receive, daemon=True)
        self._reader.start()

    def _receive(self) -> None:
        while True:
            try:
                more = os.read(self._ours, 65536)
            except OSError:  # Linux answers EIO once the last process has let go of it
                return
            self._received += more

    @property
    def written(self) -> str:
        """All that came, with its escape sequences."""
        return self._received.decode(errors="replace")

    @property
    def after_the_dashboard(self) -> str:
        """What stands on the main screen when the dashboard is gone."""
        return ESCAPES.sub("", self.written.rpartition(MAIN_SCREEN)[2])

    def shows(self, *texts: str) -> None:
        """Wait until each of the texts has been on the screen, from now or before.

        The dashboard writes only the cells that change, so a text need not arrive in one piece.
        """
        missing, looked_at = set(texts), 0
        screen = TerminalScreen(COLUMNS, LINES)

        def drawn() -> bool:
            nonlocal looked_at
            received = len(self._received)
            fresh = self._received[looked_at:received].decode(errors="replace")
            looked_at = received
            for part in re.split(f"({re.escape(END_OF_FRAME)})", fresh):
                screen.feed(part)
                seen = screen.text + ESCAPES.sub("", part)
                missing.difference_update([text for text in missing if text in seen])
            assert not missing or self.process.poll() is None, self.written
            return not missing

        until(drawn)

    def press(self, keys: str) -> None:
        """Type."""
        os.write(self._ours, keys.encode())

    def run(self) -> RunHandle:
        """The run that the engine has announced."""

        def announced() -> RunHandle | None:
            assert self.process.poll() is None, self.written
            return next((run for run in live_runs() if run.run_id == self.folder.name), None)

        return until(announced)

    def ends_with(self) -> int:
        """The exit code, once everything written has arrived."""
        code = self.process.wait(timeout=PATIENCE)
        self._reader.join(timeout=PATIENCE)
        return code

    @property
    def is_cooked(self) -> bool:
        """Whether the terminal echoes keys and edits lines, as shells want it."""
        flags = termios.tcgetattr(self._ours)[3]
        return bool(flags & termios.ECHO and flags & termios.ICANON)

    def hang_up(self) -> None:
        """Close the terminal, as a dropped connection does."""
        os.close(self._ours)
        self._ours = -1
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGHUP)  # the shell's, whose terminal it was

    def close(self) -> None:
        """End what still runs: the command passes the signal on to its engine."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
            try:
                self.process.wait(timeout=PATIENCE)
            except subprocess.TimeoutExpired:
                self.process.kill()
                self.process.wait()
        for run in live_runs():
            if run.run_id == self.folder.name:  # one that was left running
                os.kill(run.pid, signal.SIGKILL)
        if self._ours >= 0:
            os.close(self._ours)


@pytest.fixture
def open_terminal(tmp_path: Path) -> Iterator[Callable[[list[str]], Terminal]]:
    """Opens a terminal and types `treepilot` with these words into it."""
    with ExitStack() as opened:

        def begin(words: list[str]) -> Terminal:
            terminal = Terminal(words, tmp_path / f"seen-{os.getpid()}")
            opened.callback(terminal.close)
            return terminal

        yield begin


def parent_of(process: int) -> int:
    """From Linux' table of processes; the name in brackets may hold anything."""
    text = Path(f"/proc/{process}/stat").read_text("utf-8")
    return int(text.rpartition(")")[2].split()[1])


def words_of_make_run() -> list[str]:
    """What `make run` gives to treepilot when everything is installed."""
    done = subprocess.run(
        ["make", "--dry-run", "--no-print-directory", "run"],
        cwd=ROOT, capture_output=True, text=True, check=True,
    )  # fmt: skip
    command, *words = shlex.split(done.stdout.splitlines()[-1])
    assert command == ".venv/bin/treepilot"
    return words


@pytest.mark.pain("n6556", "n2917", "n2491", "n4960", "n2696", "n3770")
def test_a_mission_is_watched_to_its_end_and_q_leaves(open_terminal) -> None:
    terminal = open_terminal(["run", "01_drive_to_a_point", "--speed", "8"])
    engine = terminal.run().pid
    assert parent_of(engine) == terminal.process.pid
    terminal.shows("drive to a point", "navigate_to_pose", "SUCCESS")
    assert ALTERNATE_SCREEN in terminal.written and MAIN_SCREEN not in terminal.written
    terminal.press("q")
    assert terminal.ends_with() == 0
    assert not Path(f"/proc/{engine}").exists()
    assert terminal.after_the_dashboard.startswith("drive to a point: success")
    report = json.loads((terminal.folder / "report.json").read_text("utf-8"))
    assert (report["status"], report["collisions"]) == ("success", 0)


def test_make_run_opens_the_dashboard_and_q_may_leave_the_mission_running(open_terminal) -> None:
    terminal = open_terminal(words_of_make_run())
    run = terminal.run()
    terminal.shows("office patrol", "RUNNING")
    terminal.press("q")
    terminal.shows("The mission is still running.", "Leave it running")
    terminal.press("\x1b[B\r")  # arrow down, enter
    assert terminal.ends_with() == 0
    assert f"treepilot watch {terminal.folder}" in terminal.after_the_dashboard
    client = TelemetryClient(run)
    state_becomes(client, MissionState.RUNNING)
    assert order(client, "abort").done
    client.close()
    until(lambda: (terminal.folder / "report.json").exists())


def viewer_of(command: int) -> int:
    """The process of the dashboard, a child of the command."""
    for folder in Path("/proc").iterdir():
        with suppress(OSError):
            if folder.name.isdecimal() and parent_of(int(folder.name)) == command:
                words = (folder / "cmdline").read_bytes().split(b"\0")
                if b"tui" in words:
                    return int(folder.name)
    raise AssertionError("there is no dashboard")


def test_a_crashed_dashboard_is_reported_and_the_mission_continues(open_terminal) -> None:
    terminal = open_terminal(["run", "02_office_patrol", "--speed", "2"])
    run = terminal.run()
    terminal.shows("RUNNING")
    os.kill(viewer_of(terminal.process.pid), signal.SIGKILL)
    terminal.shows("the dashboard crashed", f"attach again with: treepilot watch {terminal.folder}")
    assert MAIN_SCREEN in terminal.written
    client = TelemetryClient(run)
    state_becomes(client, MissionState.RUNNING)
    client.close()
    assert terminal.is_cooked
    terminal.process.send_signal(signal.SIGINT)
    assert terminal.ends_with() == 130
    assert "office patrol: interrupted" in terminal.after_the_dashboard


def test_a_closed_terminal_ends_command_and_dashboard_and_not_the_mission(open_terminal) -> None:
    terminal = open_terminal(["run", "02_office_patrol", "--speed", "2"])
    run = terminal.run()
    terminal.shows("RUNNING")
    viewer = viewer_of(terminal.process.pid)
    terminal.hang_up()
    assert terminal.process.wait(timeout=PATIENCE) == 130
    until(lambda: not Path(f"/proc/{viewer}").exists())
    client = TelemetryClient(run)
    state_becomes(client, MissionState.RUNNING)
    assert order(client, "abort").done
    client.close()
