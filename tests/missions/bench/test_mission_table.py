"""Missions over seeds: the table, by hand-made rows and by the smallest mission."""

from __future__ import annotations

import pytest
from typer.testing import CliRunner

from missions.bench.bench import Options
from missions.bench.mission_runs import (
    MISSIONS as MISSION_BENCH,
)
from missions.bench.mission_runs import (
    WAITING,
    MissionEntry,
    MissionRun,
    entries_of,
    table_of,
)
from missions.cli.app import app
from missions.execution.resources import MISSIONS, mission_files
from stack.errors import InputError


def run(seed, **changes):
    values = {
        "mission": "m", "settings": "", "seed": seed, "status": "success", "cause": "",
        "time": 10.0 + seed, "driven": 5.0, "shortest": 4.0, "clearance": 0.2, "turning": 0.1,
        "jerk": 1.0, "goal_error": 0.05, "collisions": 0, "pushed_into": 0, "recoveries": 1,
        "replans": 0, "localisation_error": (0.02, 0.1), "real_time_factor": 9.0,
        "wall_seconds": 1.0,
    }  # fmt: skip
    return MissionRun(**{**values, **changes})


def test_a_row_counts_what_succeeded_and_keeps_the_worst():
    bad = run(2, status="failure", cause="NO_VALID_PATH", clearance=0.01, collisions=2)
    (row,) = table_of([run(0), run(1, localisation_error=(0.04, 0.5)), bad])
    assert (row["success"], row["collisions"], row["recoveries"]) == ("2/3", 2, 3)
    assert (row["time s"], row["clearance m"], row["error max m"]) == (11.0, 0.01, 0.5)
    assert row["error mean m"] == pytest.approx(0.08 / 3)
    assert row["failed"] == "2: NO_VALID_PATH"
    assert MISSION_BENCH.report([run(0), bad])[-1] == "  m seed 2: failure: NO_VALID_PATH"


def test_without_names_all_shipped_missions_are_run(tmp_path):
    assert len(entries_of(Options(tmp_path, seeds=range(3)))) == 3 * (
        len(mission_files()) - len(WAITING)
    )


def test_missions_of_the_same_name_are_refused(tmp_path):
    with pytest.raises(InputError, match="a is given 2 times"):
        entries_of(Options(tmp_path, names=("x/a.yaml", "y/a.yaml")))


LISTENER = """\
mission: listener
robot: {{use: replayed, log: {log}}}
map: none
run: {{wait: 3 s}}
"""


def test_a_replayed_log_has_a_row(tmp_path):
    mission = tmp_path / "listener.yaml"
    mission.write_text(LISTENER.format(log=MISSIONS / "logs" / "flat.clf.gz"), "utf-8")
    words = ["bench", "missions", str(mission), "--seeds", "1", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    assert result.stdout.splitlines()[1].split()[:4] == ["listener", "1/1", "0", "0"]


def test_the_end_of_a_recording_is_no_timeout(tmp_path):
    mission = tmp_path / "listener.yaml"
    text = LISTENER.format(log=MISSIONS / "logs" / "flat.clf.gz").replace("3 s", "1 h")
    mission.write_text(text, "utf-8")
    ended = MISSION_BENCH.row(MissionEntry(str(mission), 7200.0), tmp_path)
    assert (ended.status, ended.cause) == ("interrupted", "the recording is over")
    late = MISSION_BENCH.row(MissionEntry(str(mission), 2.0), tmp_path)
    assert (late.status, late.cause) == ("timeout", "not finished after 2 s")


def test_the_command_runs_and_resumes(tmp_path):
    words = ["bench", "missions", "01_drive_to_a_point", "--seeds", "2", "--out", str(tmp_path)]
    first = CliRunner().invoke(app, words)
    assert first.exit_code == 0 and "2/2" in first.stdout
    again = CliRunner().invoke(app, words)
    assert again.stdout == first.stdout and "2 of 2 runs are already in" in again.stderr
    other = CliRunner().invoke(app, [*words, "--robot", "jackal"])
    assert isinstance(other.exception, InputError)
