"""The dashboard under pseudo-terminals: poor ones, small ones, and ones that stall or disappear."""

from __future__ import annotations

import json
import os
import random
import re
import subprocess
import sys
import termios
import time  # watching other processes takes wall time
from collections.abc import Callable, Iterator
from pathlib import Path
from select import select

import pytest

from tests.tui.sample_viewer import HOSTILE
from tests.tui.terminal_screen import TerminalScreen

ROOT = Path(__file__).parents[2]
PATIENCE = 20.0
MAIN_SCREEN = "\x1b[?1049l"


SIXTEEN = {str(first + n) for first in (30, 40, 90, 100) for n in range(8)}
"""SGR parameters of the 16 colours."""


def colours_of(output: str) -> set[str]:
    """The SGR parameters of colours but the default ones; 38 and 48 for all beyond the 16."""
    found = re.sub(r"\b([34]8);(?:5;\d+|2;\d+;\d+;\d+)", r"\1", output)
    numbers = {n for part in re.findall(r"\x1b\[([\d;]*)m", found) for n in part.split(";")}
    return {n for n in numbers if n.isdigit() and int(n) >= 30} - {"39", "49"}


class Terminal:
    """A pseudo-terminal with a dashboard in it."""

    def __init__(self, result: Path, kind: str, size: tuple[int, int], **environment: str) -> None:
        self._result, self.size = result, size
        self.master, theirs = os.openpty()
        termios.tcsetwinsize(theirs, size[::-1])
        kept = {key: value for key, value in os.environ.items() if key != "COLORTERM"}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tests.tui.sample_viewer", str(result), kind],
            stdin=theirs, stdout=theirs, stderr=theirs, start_new_session=True, cwd=ROOT,
            env={**kept, "TERM": "xterm-256color", "COLUMNS": "", "LINES": "", **environment},
        )  # fmt: skip
        os.close(theirs)
        self.received = bytearray()

    def read_until(self, seen: Callable[[], bool]) -> None:
        """Read until something is true, or fail."""
        deadline = time.monotonic() + PATIENCE  # noqa: TID251
        while not seen():
            assert time.monotonic() < deadline, self.written[-2000:]  # noqa: TID251
            if select([self.master], [], [], 0.02)[0]:
                try:
                    self.received += os.read(self.master, 65536)
                except OSError:  # Linux' end of file once the last process has let go of it
                    assert seen(), self.written[-2000:]
                    return

    def read_for(self, seconds: float) -> None:
        """Read for some wall seconds."""
        deadline = time.monotonic() + seconds  # noqa: TID251
        self.read_until(lambda: time.monotonic() > deadline)  # noqa: TID251

    @property
    def written(self) -> str:
        return self.received.decode(errors="replace")

    def screen(self, since: int = 0) -> TerminalScreen:
        """What stands on the alternate screen, of the output from some byte on."""
        screen = TerminalScreen(*self.size)
        screen.feed(self.received[since:].decode(errors="replace").partition(MAIN_SCREEN)[0])
        return screen

    def shows(self, text: str) -> None:
        self.read_until(lambda: text in self.screen().text)

    def press(self, keys: str) -> None:
        os.write(self.master, keys.encode())

    def outcome(self) -> tuple[str, str, list[str]]:
        """How the dashboard ended, its traceback and the commands it sent."""
        self.read_until(lambda: self._result.exists())
        return self.ended()

    def ended(self) -> tuple[str, str, list[str]]:
        """The same without reading the terminal."""
        deadline = time.monotonic() + PATIENCE  # noqa: TID251
        while not self._result.exists() and time.monotonic() < deadline:  # noqa: TID251
            time.sleep(0.02)  # noqa: TID251
        name, traceback, sent = json.loads(self._result.read_text("utf-8"))
        return name, traceback, sent

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        if self.master >= 0:
            os.close(self.master)


@pytest.fixture
def open_terminal(tmp_path) -> Iterator[Callable[..., Terminal]]:
    opened = []

    def begin(kind: str = "moving", size: tuple[int, int] = (120, 40), **env: str) -> Terminal:
        opened.append(Terminal(tmp_path / "result.json", kind, size, **env))
        return opened[-1]

    yield begin
    for terminal in opened:
        terminal.close()


@pytest.mark.parametrize(
    ("environment", "colours", "ascii_only"),
    [
        ({"NO_COLOR": "1"}, set(), False),
        ({"TREEPILOT_THEME": "none"}, set(), False),
        ({"TERM": "xterm"}, SIXTEEN, False),
        ({"TREEPILOT_THEME": "16", "NO_COLOR": "1"}, SIXTEEN, False),
        ({"TERM": "linux"}, SIXTEEN, True),
        ({"TREEPILOT_THEME": "light"}, {"38", "48"}, False),
        ({"LC_ALL": "C"}, {"38", "48"}, False),
        ({"TERM": "vt100"}, None, True),
        ({"PYTHONIOENCODING": "ascii"}, {"38", "48"}, True),
        ({"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}, {"38", "48"}, True),
    ],
    ids=["NO_COLOR", "none", "xterm", "16 colours", "linux", "light", "C locale", "vt100", "ascii",
         "C locale without UTF-8"],
)  # fmt: skip
def test_a_poor_terminal_shows_all_the_words(open_terminal, environment, colours, ascii_only):
    terminal = open_terminal(**environment)
    for words in ("Office patrol", "Mission tree", "go to lab", "NO_PROGRESS", "E-STOP"):
        terminal.shows(words)
    assert terminal.written.isascii() == ascii_only
    if colours is not None:
        assert colours_of(terminal.written) <= colours
    terminal.press("q")
    assert terminal.outcome()[:2] == ("over", "")


def test_a_tiny_terminal_shows_the_state_and_the_emergency_stop(open_terminal):
    terminal = open_terminal(size=(20, 5))
    terminal.shows("⊘ ENDED")
    terminal.shows("space E-STOP")
    terminal.press("q")
    assert terminal.outcome()[0] == "over"


def test_what_was_written_in_pieces_is_what_the_whole_screen_would_be(open_terminal):
    """After many partial updates and fifty changes of size, ctrl+l writes everything again."""
    terminal = open_terminal()
    terminal.shows("NO_PROGRESS")
    sizes = random.Random(3)
    for _ in range(50):
        termios.tcsetwinsize(terminal.master, (sizes.randint(1, 100), sizes.randint(1, 300)))
        terminal.read_for(0.02)  # the signal has to reach the other process
    termios.tcsetwinsize(terminal.master, (40, 120))
    settled = len(terminal.received)
    terminal.read_until(lambda: "Full ? Help" in terminal.screen(settled).text)
    terminal.press("cll")  # costs off, other events
    terminal.read_for(1.0)
    pieces, whole = terminal.screen(settled).text, len(terminal.received)
    terminal.press("\x0c")
    terminal.read_until(lambda: "Full ? Help" in terminal.screen(whole).text)
    assert terminal.screen(whole).text == pieces
    terminal.press("q")
    assert terminal.outcome()[0] == "over"


def test_a_closed_terminal_ends_the_dashboard_and_not_the_run(open_terminal):
    terminal = open_terminal()
    terminal.shows("NO_PROGRESS")
    os.close(terminal.master)
    terminal.master = -1
    assert terminal.ended() == ("hangup", "", [])


def test_a_terminal_that_does_not_read_does_not_hold_up_the_emergency_stop(open_terminal):
    """Its buffer is full after a few whole screens; keys still arrive."""
    terminal = open_terminal()
    terminal.shows("NO_PROGRESS")
    terminal.press("\x0c" * 60 + " q")
    name, _, sent = terminal.ended()
    assert (name, sent) == ("over", ["estop"])


def test_a_crash_leaves_a_sane_terminal_and_a_traceback_for_the_supervisor(open_terminal):
    terminal = open_terminal("crash")
    name, traceback, _ = terminal.outcome()
    assert name == "crashed"
    assert traceback.startswith("Traceback") and "ValueError: out of [cheese]" in traceback
    terminal.read_until(lambda: MAIN_SCREEN in terminal.written)
    for off in ("\x1b[?1000l", "\x1b[?1003l", "\x1b[?2004l", "\x1b[?25h", "\x1b[<u"):
        assert off in terminal.written
    assert "cheese" not in terminal.written


def test_escape_sequences_in_names_are_shown_and_not_obeyed(open_terminal):
    terminal = open_terminal("hostile")
    for words in (r"title\x1b]0;owned\x07", r"\x1b]0;owned", r"NO_PROGRESS", r"\u202e"):
        terminal.shows(words)
    terminal.press("g")
    terminal.shows("Send the robot to")
    terminal.press("\x1b")
    terminal.press("?")
    terminal.press("\x1bq")
    screen = terminal.screen()
    assert not screen.controls
    assert not [text for text in screen.strings if "owned" in text]
    assert not {"\x9b", "\u202e"} & set(terminal.written)
    assert HOSTILE not in terminal.written
