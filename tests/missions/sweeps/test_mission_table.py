"""Missions over seeds: the table, by hand-made rows and by the smallest mission."""

from __future__ import annotations

from dataclasses import replace

import pytest
from typer.testing import CliRunner

from missions.bench.bench import Options
from missions.cli.app import app
from missions.execution.resources import MISSIONS, mission_files
from missions.sweeps.checking import checked
from missions.sweeps.design import RunDescription
from missions.sweeps.mission_table import WAITING, report_lines, sweep_of, table_of
from missions.sweeps.row import SweepRow
from missions.sweeps.sweep import Sweep
from missions.sweeps.sweep_file import EMPTY
from missions.sweeps.worker import RunMaker, SweepInputs
from stack.errors import InputError


def run(seed, **changes):
    row = SweepRow(
        seed, seed, {"mission": "m"}, "success", seconds=10.0 + seed, distance=5.0, clearance=0.2,
        collisions=0, pushed_into=0, error_mean=0.02, error_max=0.1, recoveries=1, replans=0,
        real_time_factor=9.0,
    )  # fmt: skip
    return replace(row, **changes)


def test_a_row_counts_what_succeeded_and_keeps_the_worst():
    bad = run(2, outcome="failure", reason="NO_VALID_PATH", clearance=0.01, collisions=2)
    (row,) = table_of([run(0), run(1, error_mean=0.04, error_max=0.5), bad])
    assert (row["success"], row["collisions"], row["recoveries"]) == ("2/3", 2, 3)
    assert (row["time s"], row["clearance m"], row["error max m"]) == (11.0, 0.01, 0.5)
    assert row["error mean m"] == pytest.approx(0.08 / 3)
    assert row["failed"] == "2: NO_VALID_PATH"
    assert report_lines([run(0), bad])[-1] == "  m seed 2: failure: NO_VALID_PATH"


def test_each_mission_meets_the_same_seeds(tmp_path):
    options = Options(tmp_path, seeds=range(3), names=("a", "b"))
    runs = [(run.seed, dict(run.settings)["mission"]) for run in sweep_of(options).descriptions()]
    assert runs == [(seed, name) for seed in range(3) for name in "ab"]
    assert sweep_of(replace(options, names=())).runs == 3 * (len(mission_files()) - len(WAITING))


def test_a_mission_that_is_given_twice_is_refused(tmp_path):
    with pytest.raises(InputError, match="the value a is listed twice"):
        sweep_of(Options(tmp_path, names=("a", "a")))


@pytest.mark.slow
def test_all_shipped_missions_can_be_swept(tmp_path):
    checked(sweep_of(Options(tmp_path)), EMPTY.refusal)


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


def test_the_end_of_a_recording_is_no_time_limit(tmp_path):
    mission = tmp_path / "listener.yaml"
    text = LISTENER.format(log=MISSIONS / "logs" / "flat.clf.gz").replace("3 s", "1 h")
    mission.write_text(text, "utf-8")
    for limit, ending in (
        (7200.0, ("failure", "the recording is over")),
        (2.0, ("time limit", "not finished after 2 s")),
    ):
        sweep = Sweep(str(mission), 1, "random", time_limit=limit)
        row = RunMaker(SweepInputs(sweep, tmp_path / "runs"))(RunDescription(0, 0))
        assert (row.outcome, row.reason) == ending


def test_the_command_runs_and_resumes(tmp_path):
    words = ["bench", "missions", "01_drive_to_a_point", "--seeds", "2", "--out", str(tmp_path)]
    first = CliRunner().invoke(app, words)
    assert first.exit_code == 0 and "2/2" in first.stdout
    again = CliRunner().invoke(app, words)
    assert again.stdout == first.stdout and "2 of 2 runs are already there" in again.stderr
    other = CliRunner().invoke(app, [*words, "--robot", "jackal"])
    assert "robot was the mission's, is jackal" in str(other.exception)
