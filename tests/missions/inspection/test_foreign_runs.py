"""What explains a run that somebody else sent executes nothing of it."""

from __future__ import annotations

import pytest
from typer.main import get_command

from missions.cli.app import app
from missions.inspection.exchange.packing import pack, unpack
from tests.missions.cli.test_cli import treepilot
from tests.missions.inspection.foreign_run import COMMANDS, explain, look_at, record

NO_DISPLAY = "runs open rerun"
"""Draws the recording of rerun, and then says how to open it where a display is."""


@pytest.fixture(scope="module")
def sent(tmp_path_factory):
    """The folder of an unpacked run, its zip file, and the file that its plugin writes."""
    folder = tmp_path_factory.mktemp("sent")
    run, marker = record(folder)
    pack(run, folder / "run.zip")
    return unpack(folder / "run.zip", folder / "elsewhere"), folder / "run.zip", marker


@pytest.mark.parametrize("command", COMMANDS)
def test_an_explanation_imports_nothing_that_a_run_brings(command, sent, tmp_path, monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    run, packed, marker = sent
    code, _, refused = explain(command, run, tmp_path, packed)
    assert code == (2 if command == NO_DISPLAY else 0), refused
    assert not marker.exists()


def test_the_dashboard_imports_nothing_that_a_run_brings(sent):
    run, _, marker = sent
    look_at(run)
    assert not marker.exists()


def test_a_repetition_imports_it_and_says_so(sent):
    run, _, marker = sent
    treepilot("runs", "--folder", str(run.parent), "repeat", run.name)
    assert marker.exists()
    marker.unlink()
    assert "executes the plugins" in treepilot("runs", "repeat", "--help").stdout


def test_every_command_that_takes_a_run_is_tested():
    """By what its help says of its arguments; options name the folder of a new run."""

    def is_run(item):
        return item.param_type_name == "argument" and "run folder" in (item.help or "")

    tested = {words[0] for words in COMMANDS.values()} | {"replay"}
    root = get_command(app)
    takes = {
        name for name, command in root.commands.items()
        if any(is_run(item) for item in command.params)
    }  # fmt: skip
    assert takes and takes <= tested
