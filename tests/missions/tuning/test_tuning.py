"""Tunings: small ones of the smallest mission, and whole ones of a formula in its place."""

from __future__ import annotations

import json
from dataclasses import replace

import pyarrow.parquet
import pytest
from typer.testing import CliRunner

from missions.cli.app import app
from missions.execution.prepare import RunOptions, prepare
from missions.execution.resources import MISSIONS, versions
from missions.sweeps.checking import checked
from missions.sweeps.factors import read_factor
from missions.sweeps.row import SweepRow
from missions.sweeps.sweep import NONE, Sweep
from missions.sweeps.sweep_file import EMPTY
from missions.sweeps.table import SweepFolder
from missions.tuning import tuning as tuning_module
from missions.tuning.objectives import read_objectives, read_weights
from missions.tuning.results import table_lines, write_findings
from missions.tuning.tuning import TuneOptions, Tuning
from stack.errors import InputError

MISSION = "01_drive_to_a_point"
RANGES = {"controller.cruise_speed": "0.3..0.6", "planner.smoother": "simple,none"}
NEAR = "[2.6, 2.2, 45 deg]"
WEIGHTS = read_weights({})
TIME_ALONE = {**dict.fromkeys(WEIGHTS, 0.0), "time": 1.0}
COST = read_objectives([], [], WEIGHTS)


def made(out, tell=lambda line: None, ranges=None, mission=MISSION, time_limit=60.0, **changes):
    factors = tuple(read_factor(*item) for item in (ranges or RANGES).items())
    sweep = Sweep(mission, 10**6, "optuna", factors, arguments={"goal": NEAR},
                  time_limit=time_limit, keep=NONE)  # fmt: skip
    options = replace(TuneOptions(out, COST, samples=2, seeds=1, confirm=0), **changes)
    return Tuning(checked(sweep, EMPTY.refusal), options, tell)


def rows_in(out):
    return SweepFolder(out).rows(10**6)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    out = tmp_path_factory.mktemp("tune") / "out"
    return out, made(out).run()


def test_baseline_and_samples_are_driven_and_measured(finished):
    out, found = finished
    assert found.scores[0].settings == {}
    assert len(found.scores) == 3 and found.scores[0].mean() == pytest.approx(1.0)
    rows = rows_in(out)
    assert [row.is_success for row in rows] == [True] * 3
    for row in rows:  # the straight line from (1, 1) to (2.6, 2.2) is 2.0 m
        assert 1.95 < row.distance / row.detour < row.distance * 1.02 < 2.5
        assert 0.0 < row.turning < 3.2 and row.jerk > 0.0  # at most the robot's own limit
        assert row.goal_error < 0.2 and row.collisions == 0
    assert min(row.seconds for row in rows[1:]) > rows[0].seconds  # the robot's own is 0.8 m/s
    table = pyarrow.parquet.read_table(out / "runs.parquet")
    assert table["controller.cruise_speed"].to_pylist()[0] is None
    assert table["jerk"].to_pylist() == [row.jerk for row in rows]


def test_another_mission_does_not_mix_with_the_results_there(finished):
    out, _ = finished
    with pytest.raises(InputError, match=r"has another sweep: time_limit was 60.0.*another --out"):
        made(out, time_limit=50.0).run()


@pytest.mark.slow
def test_bad_parameters_are_repaired(tmp_path):
    """Only time counts and the mission drives at 0.2 m/s: any sample is at least 0.3 m/s."""
    text = (MISSIONS / f"{MISSION}.yaml").read_text("utf-8")
    slow = tmp_path / "slow.yaml"
    slow.write_text(
        text.replace("run:", "navigation: {controller: {cruise_speed: 0.2}}\nrun:"), "utf-8"
    )
    objectives = read_objectives([], [], TIME_ALONE)
    tuning = made(tmp_path / "t", mission=str(slow), objectives=objectives, samples=3, confirm=1)
    found = tuning.run()
    assert found.best.settings and found.best.mean() < 0.8  # 0.2 of at least 0.3 m/s, with the ends
    assert [score.settings for score in found.held_out] == [{}, found.best.settings]
    assert [set(score.values[0]) for score in found.held_out] == [{1}, {1}]  # not used before
    line = [*table_lines(found)][-1]
    assert "overrides controller.cruise_speed; change it there" in line


def test_a_run_out_of_time_has_failed(tmp_path):
    found = made(tmp_path / "t", time_limit=2.0, samples=1).run()
    assert [score.mean() for score in found.scores] == [10.0, 10.0]
    assert {(row.outcome, row.reason) for row in rows_in(tmp_path / "t")} == {
        ("time limit", "not finished after 2 s")
    }


SPEED = {"controller.cruise_speed": "0.2..0.8", "controller.lookahead_time": "0.4..2"}


def driven(run):
    """A row by a formula: 1 / speed long, as near to walls as it is fast; 0.3 m/s is usual."""
    settings = dict(run.settings)
    speed = float(settings.get("controller.cruise_speed", 0.3))
    away = abs(float(settings.get("controller.lookahead_time", 2.0)) - 1.0)
    return SweepRow(
        run.number, run.seed, settings, "success", seconds=(10.0 + 2.0 * away) / speed + run.seed,
        distance=5.0, clearance=0.5 - 0.5 * speed, collisions=0, detour=1.0, turning=0.5, jerk=2.0,
        goal_error=0.05, versions=versions(),
    )  # fmt: skip


@pytest.fixture
def formula(monkeypatch):
    """In place of the mission; returns the runs that were made."""
    runs = []

    def made_rows(inputs, wanted, execution):
        for run in wanted:
            runs.append(run)
            yield driven(run)

    monkeypatch.setattr(tuning_module, "made_rows", made_rows)
    return runs


def plain(result):
    return [(dict(one.settings), one.values, one.is_pruned) for one in result.scores]


def test_bad_parameters_are_repaired_within_sixty_samples(tmp_path, formula):
    """The best is 0.8 m/s and 1 s: 12.5 s, in place of 40 s, plus the seed."""
    objectives = read_objectives([], [], TIME_ALONE)
    found = made(
        tmp_path / "t", ranges=SPEED, objectives=objectives, samples=60, seeds=3, confirm=4
    ).run()
    (before, after) = found.held_out
    assert set(after.values[0]) == {3, 4, 5, 6}
    times = [driven(run).seconds for run in formula if run.seed == 3][-1]
    assert (12.5 + 3.0) / times > 0.95  # of the score of the best there is
    assert after.differences[0].verdict == "better" and before.settings == {}
    assert found.importances[0]["controller.cruise_speed"] > 0.5


def test_hopeless_settings_end_early(tmp_path, formula):
    found = made(tmp_path / "t", ranges=SPEED, samples=30, seeds=4).run()
    pruned = [score for score in found.scores if score.is_pruned]
    assert pruned and all(score.seeds < 4 for score in pruned)
    assert len(formula) == 4 + sum(score.seeds for score in found.scores[1:])
    assert found.best not in pruned and found.best.seeds == 4
    worst = max(score.mean() for score in found.scores if not score.is_pruned)
    assert all(score.mean() > found.best.mean() for score in pruned) and worst > 0.0


@pytest.mark.parametrize("stop", [2, 9, 20])
def test_an_interrupted_tuning_is_continued_as_if_nothing_was(tmp_path, formula, monkeypatch, stop):
    whole = plain(made(tmp_path / "a", ranges=SPEED, samples=12, seeds=3).run())
    ordered = [(run.seed, run.settings) for run in formula]
    formula.clear()
    write = SweepFolder.write

    def interrupted(self, journal, row):
        write(self, journal, row)
        if len(formula) == stop:
            raise KeyboardInterrupt

    monkeypatch.setattr(SweepFolder, "write", interrupted)
    with pytest.raises(KeyboardInterrupt):
        made(tmp_path / "b", ranges=SPEED, samples=12, seeds=3).run()
    assert plain(made(tmp_path / "b", ranges=SPEED, samples=12, seeds=3).run()) == whole
    assert [(run.seed, run.settings) for run in formula] == ordered


def test_more_samples_add_to_the_results(tmp_path, formula):
    few = plain(made(tmp_path / "t", ranges=SPEED, samples=5).run())
    more = plain(made(tmp_path / "t", ranges=SPEED, samples=9).run())
    assert more[:6] == few and len(more) == 10 and len(formula) == 10
    assert more == plain(made(tmp_path / "u", ranges=SPEED, samples=9).run())


def test_other_objectives_and_seeds_use_the_runs_that_are_there(tmp_path, formula):
    out, alone = tmp_path / "t", read_objectives([], [], TIME_ALONE)
    first = made(out, ranges=SPEED, samples=6).run()
    other = made(out, ranges=SPEED, objectives=alone, samples=6).run()
    assert len(formula) == 7
    assert {*map(str, [one.settings for one in first.scores])} == {
        *map(str, [one.settings for one in other.scores])
    }
    made(out, ranges=SPEED, objectives=alone, samples=6, seeds=2).run()
    assert {run.seed for run in formula[7:]} == {1}
    again = made(out, ranges=SPEED, samples=6).run()
    assert plain(again) == plain(first)


def test_two_objectives_have_a_front_with_a_file_for_each_setting(tmp_path, formula):
    """Time falls and clearance falls with the speed: every speed is on the front, if 1 s is."""
    objectives = read_objectives(["time"], ["clearance"], WEIGHTS)
    out = tmp_path / "t"
    found = made(out, ranges=SPEED, objectives=objectives, samples=20, seeds=2, confirm=2).run()
    front = found.front
    assert len(front) > 3 and not any(score.is_pruned for score in found.scores)
    times, wide = [score.mean(0) for score in front], [score.mean(1) for score in front]
    assert times == sorted(times) and wide == sorted(wide)
    assert len(found.held_out) == 6  # the baseline and five of the front
    names = [file.name for file in write_findings(found, out)]
    assert {"table.txt", "scores.json", "report.html", "front-1.yaml"} <= {*names}
    page = (out / "report.html").read_text("utf-8")
    assert "clearance m over time s" in page and "<polyline" in page and "Seeds held out" in page
    assert "<script" not in page and "http" not in page
    scores = json.loads((out / "scores.json").read_text("utf-8"))
    assert scores["front"] == [dict(score.settings) for score in front]


def test_the_best_is_a_parameter_file_that_a_mission_can_name(tmp_path, formula):
    out = tmp_path / "t"
    found = made(out, ranges=SPEED, samples=8, confirm=1).run()
    write_findings(found, out)
    text = (MISSIONS / f"{MISSION}.yaml").read_text("utf-8")
    mission = tmp_path / "mine.yaml"
    mission.write_text(
        text.replace("world: small_room", "world: small_room\nparameters: [t/best.yaml]")
    )
    parameters = prepare(mission, RunOptions()).choices["controller"].parameters
    assert str(parameters.cruise_speed) == found.best.settings["controller.cruise_speed"]


def test_where_nothing_is_better_there_is_no_parameter_file(tmp_path, formula):
    out, slow = tmp_path / "t", {"controller.cruise_speed": "0.2..0.25"}
    objectives = read_objectives([], [], TIME_ALONE)
    found = made(out, ranges=slow, objectives=objectives, samples=4, confirm=1).run()
    (out / "best.yaml").touch()
    names = [file.name for file in write_findings(found, out)]
    assert names == ["table.txt", "scores.json", "report.html"]
    assert not (out / "best.yaml").exists() and not found.held_out
    assert "none of the 4 settings beats the unchanged mission" in (out / "table.txt").read_text()


def test_combinations_that_the_mission_refuses_are_left_out(tmp_path, formula):
    both = {"controller.use": "mppi,pure_pursuit", "controller.cost_slowdown": "0.1..0.4"}
    told: list[str] = []
    found = made(tmp_path / "t", told.append, ranges=both, samples=4).run()
    assert len(found.scores) == 5
    assert {one.settings["controller.use"] for one in found.scores[1:]} == {"pure_pursuit"}
    assert found.left_out and all(line["controller.use"] == "mppi" for line, _ in found.left_out)
    assert any(line.startswith("left out: ") for line in told)


def test_a_measure_that_the_mission_lacks_cannot_be_an_objective(tmp_path, formula, monkeypatch):
    monkeypatch.setattr(
        tuning_module, "made_rows",
        lambda inputs, wanted, execution: (replace(driven(run), goal_error=None) for run in wanted),
    )  # fmt: skip
    objectives = read_objectives(["goal_error"], [], WEIGHTS)
    with pytest.raises(InputError, match="01_drive_to_a_point has no goal_error: true distance"):
        made(tmp_path / "t", objectives=objectives).run()


def test_without_optuna_the_command_says_so(monkeypatch):
    monkeypatch.setattr("stack.optional_packages.find_spec", lambda _: None)
    done = CliRunner().invoke(app, ["tune", MISSION, "--try", "planner.tolerance=1..2"])
    assert "`treepilot tune` needs the Python package optuna" in str(done.exception)
    assert "pip install 'treepilot[tune]'" in str(done.exception)


def test_an_interrupted_command_prints_what_there_is(tmp_path, formula, monkeypatch):
    def stop(line):
        if line.startswith("   2/3"):
            raise KeyboardInterrupt

    monkeypatch.setattr("missions.cli.tune.tell", stop)
    words = ["tune", MISSION, "--set", f"goal={NEAR}", "--samples", "3", "--seeds", "1"]
    words += [f"--try={name}={text}" for name, text in SPEED.items()]
    done = CliRunner().invoke(app, [*words, "--out", str(tmp_path / "t")])
    assert done.exit_code == 130, done.output
    assert "baseline" in done.stdout and len(rows_in(tmp_path / "t")) == 3


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--try", "planner.tolerance=1..9"], "--try planner.tolerance: 9 is refused: "),
        (["--try", "planner.tolerance=2..1"], "--try planner.tolerance=2..1: 2 is not below 1"),
        (["--try", "planner.smoother=simple..none"], "'simple' is not a number"),
        (["--try", "planner.smother=a,b"], "did you mean 'smoother'"),
        (["--try", "planner.tolerance"], "--try planner.tolerance: expected NAME=VALUE"),
        (["--try", "planner.tolerance=1..2", "--weight", "x=1"], "--weight x: unknown measure"),
        (["--try", "planner.tolerance=1..2", "--minimise", "x"], "--minimise x: unknown measure"),
        (["--try", "planner.tolerance=1..2", "--time-limit", "1 m"], "--time-limit 1 m: '1 m' is"),
    ],
)
def test_wrong_input_is_refused_before_anything_runs(words, sentence, tmp_path):
    done = CliRunner().invoke(app, ["tune", MISSION, *words, "--out", str(tmp_path / "t")])
    assert isinstance(done.exception, InputError) and sentence in str(done.exception)
    assert not (tmp_path / "t").exists()
