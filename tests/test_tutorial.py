"""docs/tutorial.md from an empty folder: each command prints what the page shows."""

from __future__ import annotations

import re
import shlex
import subprocess
from pathlib import Path

import pytest
from typer.testing import CliRunner

from missions.cli.app import app

PAGE = Path(__file__).parents[1] / "docs" / "tutorial.md"
BLOCK = re.compile(r"^```(\w+)(?: file=(\S+))?\n(.*?)^```$", re.MULTILINE | re.DOTALL)

COMPILING = re.compile(
    r"^compiling \d+ kernels.*?^compiled \d+ kernels[^\n]*\n", re.MULTILINE | re.DOTALL
)
"""Lines of a first run ever on a machine; the page shows a later one."""


def commands_of(text: str) -> list[tuple[str, str]]:
    """The commands of a console block with the lines that follow them."""
    parts = re.split(r"^\$ (.*)\n", text, flags=re.MULTILINE)
    assert parts[0] == ""
    return list(zip(parts[1::2], parts[2::2], strict=True))


def pattern_of(shown: str) -> str:
    """A line of `…` stands for any lines, `…` inside a line for any characters."""
    lines = shown.splitlines(keepends=True)
    return "".join(
        "(?:.*\n)*?" if line == "…\n" else re.escape(line).replace("…", ".*") for line in lines
    )


def output_of(line: str) -> str:
    """What a command prints; each fails or succeeds as the page says."""
    words = shlex.split(line)
    if words[0] == "treepilot":
        done = CliRunner().invoke(app, words[1:], catch_exceptions=False, env={"COLUMNS": "100"})
        code, output = done.exit_code, done.output
    else:
        ran = subprocess.run(line, shell=True, check=False, text=True, capture_output=True)
        code, output = ran.returncode, ran.stdout + ran.stderr
    assert code == (2 if line == "treepilot check wrong.yaml" else 0), output
    return output


@pytest.mark.slow
def test_the_tutorial_prints_what_it_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    commands = 0
    for language, file, text in BLOCK.findall(PAGE.read_text("utf-8")):
        if file:
            (tmp_path / file).parent.mkdir(exist_ok=True)
            (tmp_path / file).write_text(text, "utf-8")
            continue
        assert language == "console"
        for line, shown in commands_of(text):
            got = COMPILING.sub("", output_of(line))
            assert re.fullmatch(pattern_of(shown), got), f"$ {line}\n{got}"
            commands += 1
    assert commands == 15
    assert (tmp_path / "runs" / "first" / "snapshots.mcap").stat().st_size > 50_000
    assert (tmp_path / "flat.png").read_bytes().startswith(b"\x89PNG")
