"""A small tuning of the smallest mission: the table, resuming, and what comes of it."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from missions.bench.mission_runs import QUIET, MissionEntry, MissionRun
from missions.bench.run_table import rows_in
from missions.cli.app import app
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS
from missions.tuning.results import parameter_file, table_lines, write_findings
from missions.tuning.scoring import Score
from missions.tuning.tuning import DEFAULT_WEIGHTS, TuneOptions, Tuning, TuningResult
from stack.errors import InputError

MISSION = "01_drive_to_a_point"
RANGES = {"controller.cruise_speed": "0.3..0.6", "planner.smoother": "simple,none"}
NEAR = "[2.6, 2.2, 45 deg]"
ENTRY = MissionEntry(MISSION, 60.0, replace(QUIET, arguments={"goal": NEAR}))
TIME_ALONE = {**dict.fromkeys(DEFAULT_WEIGHTS, 0.0), "time": 1.0}


def tuned(out, tell=lambda line: None, **changes):
    options = replace(TuneOptions(out, samples=2, seeds=1, confirm=0), **changes)
    return Tuning(ENTRY, RANGES, options, tell).run()


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("tune")
    return out, tuned(out)


def test_baseline_and_samples_are_driven_and_measured(finished):
    out, found = finished
    assert found.scores[0].settings == {}
    assert len(found.scores) == 3 and found.scores[0].cost == pytest.approx(1.0)
    rows = list(rows_in(out, MissionRun).values())
    assert [row.success for row in rows] == [True] * 3
    for row in rows:  # the straight line from (1, 1) to (2.6, 2.2) is 2.0 m
        assert 1.95 < row.shortest < row.driven * 1.02 < 2.5
        assert 0.0 < row.turning < 3.2 and row.jerk > 0.0  # at most the robot's own limit
        assert row.goal_error < 0.2 and row.collisions == 0
    assert min(row.time for row in rows[1:]) > rows[0].time  # the robot's own speed is 0.8 m/s


def test_a_tuning_goes_on_where_it_stopped_and_may_be_widened(finished, tmp_path):
    out, found = finished
    table = out / "runs.jsonl"
    before = table.read_text("utf-8")
    lines = before.splitlines(keepends=True)
    table.write_text("".join(lines[:2]) + lines[2][:40], "utf-8")  # cut off while it was written
    told: list[str] = []
    again = tuned(out, told.append)
    assert "2 of 3 runs are already in" in told[0] and told[1].startswith("   3/3  controller.")
    # equal but for the time that the machine took
    assert [score.costs for score in again.scores] == [score.costs for score in found.scores]
    assert table.read_text("utf-8").count("\n") == 3


def test_another_mission_does_not_mix_with_the_results_there(finished):
    out, _ = finished
    other = replace(ENTRY, options=replace(QUIET, arguments={"goal": "[4, 4, 0]"}))
    with pytest.raises(InputError, match=r"results of other settings.*choose another --out"):
        Tuning(other, RANGES, TuneOptions(out, samples=2), print)


def score(name="", cost=1.0, noise=0.01):
    settings = {"controller.cruise_speed": name, "planner.smoother": "none"} if name else {}
    costs, means = {0: cost, 1: cost}, {"time": 20.0 * cost, "jerk": 2.0}
    return Score(settings, costs, means, cost - 1.0, noise, 2)


@pytest.fixture(scope="module")
def made_up(finished):
    _, found = finished
    return TuningResult(found.plan, found.ranges, [score(), score("0.5", 0.8), score("0.31", 1.4)])


def test_the_table_has_the_best_first_and_marks_the_baseline(made_up):
    lines = list(table_lines(made_up))
    assert [line.split()[:2] for line in lines[1:4]] == [
        ["1", "0.800"], ["2", "1.000"], ["3", "1.400"],
    ]  # fmt: skip
    assert "-0.200 ± 0.010  better" in lines[1] and "16 -20%" in lines[1]
    assert "baseline" in lines[2] and "unchanged" in lines[2]
    assert "partly better by chance" in lines[-1]
    noisy = replace(made_up, scores=[score(), score("0.5", 0.8, noise=0.1)])
    assert "within the noise of the seeds" in list(table_lines(noisy))[-2]


def test_the_best_is_a_parameter_file_that_a_mission_can_name(made_up, tmp_path):
    text = (MISSIONS / f"{MISSION}.yaml").read_text("utf-8")
    mission = tmp_path / "mine.yaml"
    mission.write_text(text.replace("world: small_room", "world: small_room\nparameters: [b.yaml]"))
    (tmp_path / "b.yaml").write_text(parameter_file(made_up), "utf-8")
    choices = prepare(mission, RunOptions()).choices
    assert choices["controller"].parameters.cruise_speed == 0.5
    assert choices["planner"].parameters.smoother == "none"


def test_what_the_mission_sets_itself_is_said(made_up, tmp_path):
    text = (MISSIONS / f"{MISSION}.yaml").read_text("utf-8")
    mission = tmp_path / "mine.yaml"
    mission.write_text(
        text.replace("run:", "navigation: {controller: {cruise_speed: 40 cm/s}}\nrun:")
    )
    own = replace(made_up, plan=prepare(mission, RunOptions()))
    assert " overrides controller.cruise_speed; change it there" in list(table_lines(own))[-1]


def test_where_nothing_is_better_there_is_no_parameter_file(made_up, tmp_path):
    write_findings(made_up, tmp_path)
    assert (tmp_path / "best.yaml").exists()
    worse = replace(made_up, scores=[score(), score("0.5", 1.2)])
    names = [file.name for file in write_findings(worse, tmp_path)]
    assert names == ["table.txt", "scores.json"] and not (tmp_path / "best.yaml").exists()
    assert "none of the 1 settings beats the unchanged mission" in (
        tmp_path / "table.txt"
    ).read_text("utf-8")
    costs = [item["cost"] for item in json.loads((tmp_path / "scores.json").read_text())["scores"]]
    assert costs == [1.0, 1.2]


@pytest.mark.slow
def test_refining_and_confirming_add_runs(tmp_path):
    """Only time counts and the mission drives at 0.2 m/s: the best is a sample, all are faster."""
    text = (MISSIONS / f"{MISSION}.yaml").read_text("utf-8")
    slow = tmp_path / "slow.yaml"
    near = text.replace("[5.0, 3.8, 90 deg]", NEAR)
    slow.write_text(
        near.replace("run:", "navigation: {controller: {cruise_speed: 0.2}}\nrun:"), "utf-8"
    )
    told: list[str] = []
    options = TuneOptions(tmp_path / "tune", samples=2, seeds=1, refine=1, confirm=1)
    options = replace(options, weights=TIME_ALONE)
    found = Tuning(MissionEntry(str(slow), 60.0), RANGES, options, told.append).run()
    assert len(found.scores) == 4  # baseline, two samples, half of two samples more
    assert any("refining, turn 1: controller.cruise_speed 0." in line for line in told)
    assert found.best.settings and found.best.cost < 0.8  # 0.2 of at least 0.3 m/s, less its ends
    assert [item.settings for item in found.confirmed] == [{}, found.best.settings]
    assert [set(item.costs) for item in found.confirmed] == [{1}, {1}]  # the seed not used before
    assert len(rows_in(options.out, MissionRun)) == 6  # four settings, then two of them again


def test_a_baseline_that_nothing_beats_is_not_confirmed(finished):
    out, _ = finished  # whose runs are all in the table
    told: list[str] = []
    again = tuned(out, told.append, confirm=1, weights=TIME_ALONE)
    assert again.best.settings == {}  # 0.8 m/s: the robot's own speed is the fastest there is
    assert again.confirmed == () and not any("seeds not used before" in line for line in told)


def test_a_run_out_of_time_has_failed(tmp_path):
    found = tuned(tmp_path, time_limit=2.0, samples=1)
    assert [item.cost for item in found.scores] == [10.0, 10.0]
    (row, _) = rows_in(tmp_path, MissionRun).values()
    assert (row.status, row.cause) == ("timeout", "not finished after 2 s")


def test_an_interrupted_tuning_keeps_its_table(tmp_path, monkeypatch):
    def stop(line):
        if line.startswith("   2/3"):
            raise KeyboardInterrupt

    monkeypatch.setattr("missions.cli.tune._tell", stop)
    words = [
        "tune",
        MISSION,
        "--set",
        f"goal={NEAR}",
        "--samples",
        "2",
        "--seeds",
        "1",
        "--out",
        str(tmp_path),
    ]
    words += [f"--try={name}={text}" for name, text in RANGES.items()]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 130
    assert "baseline" in done.stdout and len(rows_in(tmp_path, MissionRun)) == 2


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--try", "planner.tolerance=1..9"], "9 m must be at most 5 m; allowed: >= 0 and <= 5"),
        (["--try", "planner.tolerance"], "--try planner.tolerance: expected NAME=VALUE"),
        (["--try", "planner.tolerance=1..2", "--weight", "x=1"], "--weight x: unknown measure"),
        (["--try", "planner.tolerance=1..2", "--time-limit", "1 m"], "--time-limit 1 m: '1 m' is"),
    ],
)
def test_wrong_input_is_refused_before_anything_runs(words, sentence, tmp_path):
    done = CliRunner().invoke(app, ["tune", MISSION, *words, "--out", str(tmp_path / "t")])
    assert isinstance(done.exception, InputError) and sentence in str(done.exception)
    assert not (tmp_path / "t").exists()
