"""The command on a mission that a long loss of commands breaks: found, shrunk, written, run."""

import json

import pytest
from typer.testing import CliRunner

import missions
from missions.cli.app import app
from missions.falsify.margin import IRRELEVANT, margin_of, read_requirement
from missions.falsify.ranges import fault_factors
from missions.sweeps.row import SweepRow
from stack.errors import InputError

SHORT = """\
# drives half a metre
mission: short
robot: scout
world: small_room
start: [1.0, 1.0, 0]
run:
  navigate_to_pose: {goal: [1.6, 1.0, 0]}
  timeout: 5 s
"""


def row(**figures):
    return SweepRow(0, 0, {}, figures.pop("outcome", "success"), **figures)


def test_margins_are_relative_and_failures_are_below_any_success():
    clearance = read_requirement("clearance > 0.1", 60.0)
    time = read_requirement("time", 60.0)
    assert time.text == "time < 60"
    good = row(clearance=0.15, seconds=45.0, collisions=0)
    assert margin_of(good, [clearance]) == pytest.approx(0.5)
    assert margin_of(good, [clearance, time]) == pytest.approx(0.25)
    assert margin_of(row(clearance=0.05, collisions=0), [clearance]) == pytest.approx(-0.5)
    assert margin_of(row(clearance=0.5, collisions=1), [clearance]) == -1.0
    assert margin_of(row(outcome="failure", clearance=0.5), [clearance]) == -1.0
    assert margin_of(row(outcome="refused"), [clearance]) == IRRELEVANT
    for text in ("clearence", "success > 0.9", "3"):
        with pytest.raises(InputError, match="--margin"):
            read_requirement(text, 60.0)


def test_factors_of_faults_are_their_times_and_public_numbers():
    factors = {one.name: (one.low, one.high, one.unit) for one in fault_factors(["push"], 20.0)}
    assert factors == {
        "fault.push.at": (0.0, 20.0, "s"), "fault.push.forward": (-3.0, 3.0, "m"),
        "fault.push.left": (-3.0, 3.0, "m"),
    }  # fmt: skip
    names = [one.name for one in fault_factors(["lidar_dropout", "moved_furniture"], 20.0)]
    assert names == [
        "fault.lidar_dropout.at", "fault.lidar_dropout.for", "fault.lidar_dropout.share",
        "fault.moved_furniture.share", "fault.moved_furniture.distance",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--faults", "wet_floor"], "there is no fault 'wet_floor'"),
        (["--vary", "start.x=uniform(1, 99)"], "start.x: 99 is refused"),
        (["--vary", "start.x=uniform(3, 1)"], "3 is not below 1"),
        ([], "there is nothing to search"),
    ],
)
def test_errors_come_before_the_first_run(tmp_path, words, sentence, monkeypatch):
    monkeypatch.setattr("missions.falsify.falsifier.made_rows", None)
    (tmp_path / "m.yaml").write_text(SHORT)
    result = CliRunner().invoke(app, ["falsify", str(tmp_path / "m.yaml"), *words])
    assert sentence in str(result.exception)


@pytest.mark.slow
def test_a_long_loss_of_commands_is_found_shrunk_and_reproduced(tmp_path):
    (tmp_path / "m.yaml").write_text(SHORT)
    words = [
        "falsify", str(tmp_path / "m.yaml"), "--faults", "link_loss,gyro_bias", "--runs", "24",
        "--vary", "fault.gyro_bias.bias=uniform(0, 0.01)", "--time-limit", "20s",
        "--vary", "fault.link_loss.at=uniform(0, 1)", "--out", str(tmp_path / "out"),
    ]  # fmt: skip
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 1, result.output
    text = (tmp_path / "out" / "falsified.yaml").read_text()
    assert text.startswith("# Breaks with seed 0: margin -1 (failure") and "gyro_bias" not in text
    assert "# drives half a metre" in text and "{link_loss: " in text
    report = missions.run(tmp_path / "out" / "falsified.yaml", seed=0)
    assert report.status == "failure" and "TIMED_OUT" in report.reason
    rows = [
        json.loads(line) for line in (tmp_path / "out" / "journal.jsonl").read_text().splitlines()
    ]
    again = CliRunner().invoke(app, words)  # nothing is left to run but the baseline
    assert again.exit_code == 1
    assert len((tmp_path / "out" / "journal.jsonl").read_text().splitlines()) == len(rows)
