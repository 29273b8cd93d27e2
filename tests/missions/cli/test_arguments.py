"""Which terminals get a dashboard, decided under real pseudo-terminals."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
ASK = "from missions.cli.arguments import on_a_terminal; print(on_a_terminal())"
ASK_FOR_EACH = """\
import curses, os, sys  # curses reads the terminal database once in a process
from missions.cli.arguments import on_a_terminal
for term in sys.argv[1:]:
    child = os.fork()
    if not child:
        os.environ["TERM"] = term
        print(term, on_a_terminal(), flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""


def under_a_terminal(
    words: list[str], term: str | None, errors: int | None = None, code: int = 0
) -> str:
    """Output of a Python process whose terminal has this TERM; None: it is not set."""
    ours, theirs = os.openpty()
    environment = {key: value for key, value in os.environ.items() if key != "TERM"}
    process = subprocess.Popen(
        [sys.executable, *words], stdin=theirs, stdout=theirs, cwd=ROOT,
        stderr=theirs if errors is None else errors,
        env=environment if term is None else {**environment, "TERM": term},
    )  # fmt: skip
    os.close(theirs)
    written = b""
    try:
        while more := os.read(ours, 65536):
            written += more
    except OSError:  # Linux answers EIO once the last process has let go of it
        pass
    os.close(ours)
    assert process.wait(timeout=60.0) == code, written
    return written.decode().replace("\r\n", "\n")


def test_a_terminal_with_cursor_positions_shows_the_dashboard():
    terms = ["xterm-256color", "xterm", "vt100", "linux", "of-tomorrow"]
    written = under_a_terminal(["-c", ASK_FOR_EACH, *terms], None)
    assert written.splitlines() == [f"{term} True" for term in terms]


@pytest.mark.parametrize(
    ("term", "kind"), [("dumb", "TERM=dumb"), (None, "TERM is not set"), ("", "TERM is not set")]
)
def test_a_terminal_without_them_is_told_so(term, kind):
    told = f"this terminal cannot show the dashboard ({kind})\n"
    assert under_a_terminal(["-c", ASK], term) == f"{told}False\n"


def test_no_dashboard_is_drawn_into_a_file():
    assert under_a_terminal(["-c", ASK], "xterm", subprocess.DEVNULL) == "False\n"


def test_a_theme_that_does_not_exist_is_told_before_anything_moves(tmp_path, monkeypatch):
    monkeypatch.setenv("TREEPILOT_THEME", "pink")
    words = ["-m", "missions.cli.app", "run", "01_drive_to_a_point", "--out", str(tmp_path / "run")]
    written = under_a_terminal(words, "xterm", code=2)
    assert "TREEPILOT_THEME=pink: expected dark, light, 16 or none" in written
    assert not (tmp_path / "run").exists() and "\x1b[?1049h" not in written


@pytest.mark.slow
def test_run_prints_progress_lines_there_instead(tmp_path):
    words = ["-m", "missions.cli.app", "run", "01_drive_to_a_point", "--speed", "max",
             "--out", str(tmp_path / "run")]  # fmt: skip
    written = under_a_terminal(words, "dumb")
    assert written.startswith("this terminal cannot show the dashboard (TERM=dumb)\n")
    assert "drive to a point: success" in written
    assert "\x1b" not in written
