"""A run that crashes is a row of its table; the other runs are made all the same."""

from __future__ import annotations

import json
import os
import signal
from dataclasses import dataclass, replace

import pytest

from missions.bench.mission_runs import MISSION_WORK, QUIET, MissionEntry
from missions.bench.resumable import TableOptions, Work, fill
from missions.bench.runs import Case, Entry, Rules, Setup
from missions.bench.trial import run_trial
from missions.execution.resources import WORLDS
from missions.inspection.scaffold import new_component
from stack.errors import InputError
from stack.sim.worlds.world_file import read_world


@dataclass(frozen=True)
class Division:
    """An entry: 12 is divided by its number."""

    by: int

    @property
    def key(self):
        return "division", "12", self.by


@dataclass(frozen=True)
class Quotient:
    by: int
    text: str
    wall_seconds: float = 0.0

    @property
    def key(self):
        return "division", "12", self.by


def divide(entry: Division) -> Quotient:
    if entry.by == 7:
        raise InputError("no sevens")
    if entry.by == 9:
        os.kill(os.getpid(), signal.SIGKILL)
    if entry.by == 11:
        os._exit(3)
    return Quotient(entry.by, str(12 // entry.by))


def read(values: dict) -> Quotient:
    return Quotient(**values)


def text(row: Quotient) -> str:
    return row.text


def crashed(entry: Division, sentence: str) -> Quotient:
    return Quotient(entry.by, sentence)


WORK = Work(divide, read, text, crashed)


def test_a_crash_is_a_row_with_file_and_line(tmp_path, capsys):
    rows = fill(
        [Division(3), Division(0), Division(4)], TableOptions(tmp_path), WORK, lambda _: None
    )
    assert [row.text for row in rows][::2] == ["4", "3"]
    assert rows[1].text.startswith(
        "ZeroDivisionError: integer division or modulo by zero (test_cra"
    )
    stored = [json.loads(line) for line in (tmp_path / "runs.jsonl").read_text().splitlines()]
    assert [row["by"] for row in stored] == [3, 0, 4]
    assert "the run ('division', '12', 0) crashed\nTraceback" in capsys.readouterr().err


def test_wrong_input_ends_the_table(tmp_path):
    with pytest.raises(InputError, match="no sevens"):
        fill([Division(3), Division(7), Division(4)], TableOptions(tmp_path), WORK, lambda _: None)


@pytest.fixture
def faulty(tmp_path):
    """A mission whose estimator raises an exception in the first step."""
    file, _ = new_component("estimator", "faulty", tmp_path / "plugins")
    text = file.read_text()
    at = text.index("    def update(")
    at = text.index('"""', text.index('"""', at) + 3) + 3
    file.write_text(f"{text[:at]}\n        raise KeyError('inside')\n{text[at:]}")
    mission = tmp_path / "faulty.yaml"
    mission.write_text(
        "mission: faulty\nrobot: scout\nworld: small_room\nplugins: [./plugins]\n"
        "localisation: faulty\nplaces: {goal: [5, 1, 0]}\nrun: {navigate_to_pose: $goal}\n"
    )
    return mission


def test_both_benches_make_a_row_of_a_failing_plugin(faulty):
    run = MISSION_WORK.row(MissionEntry(str(faulty), 60.0))
    assert run.status == "error" and "KeyError: 'inside' (faulty.py:" in run.cause
    case = Case("room", read_world(WORLDS / "small_room.yaml"))
    trial = run_trial(Entry(Setup(str(faulty), Rules(0.3, 60.0)), case, 0))
    assert trial.run.status == "gave_up" and "KeyError: 'inside' (faulty.py:" in trial.run.cause


def test_a_crash_outside_the_loop_is_a_row_too(faulty, monkeypatch, capsys):
    def broken(*_):
        raise RuntimeError("no figures")

    monkeypatch.setattr("missions.bench.mission_runs._shortest", broken)
    run = MISSION_WORK.row(MissionEntry(str(faulty), 60.0, replace(QUIET, seed=3)))
    assert (run.status, run.seed, run.success) == ("crashed", 3, False)
    assert run.cause.startswith("RuntimeError: no figures")
    assert "crashed\nTraceback" in capsys.readouterr().err


def test_a_process_that_dies_loses_only_its_own_run(tmp_path):
    entries = [Division(by) for by in (1, 9, 2, 11, 3, 4)]
    rows = fill(entries, TableOptions(tmp_path, jobs=2), WORK, lambda _: None)
    assert [row.text for row in rows] == [
        "12", "the process was ended by SIGKILL", "6", "the process ended with exit code 3",
        "4", "3",
    ]  # fmt: skip


def test_wrong_input_ends_a_table_that_several_processes_fill(tmp_path):
    entries = [Division(by) for by in (1, 7, 2)]
    with pytest.raises(InputError, match="no sevens"):
        fill(entries, TableOptions(tmp_path, jobs=2), WORK, lambda _: None)
