"""Missions on logs of other programs: `robot: {use: replayed, log: $log}` and `--replay`."""

import gzip
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

import missions
from missions.cli.app import app
from missions.execution.prepare import RunOptions, diagnose, prepare
from missions.execution.run import Run
from missions.execution.running import run_in_turns
from stack.telemetry.event_log import read_events
from stack.types import Observation, Odometry, Pose2D, Scan, Twist
from tests.robots.logs.log_writers import flaser

MISSION = """
mission: a log
robot: {use: replayed, log: $log, after: $rest}
arguments:
  log: {type: path, default: drive.clf.gz}
  rest: {type: duration, default: 2 s}
  range: {type: float, unit: m, default: 2.0}
navigation:
  costmap: {obstacle_range: $range}
run:
  sequence:
    - wait: 3 s
    - say: here
    - wait: 5 s
"""


@pytest.fixture
def folder(tmp_path):
    """A mission and a log of 5 s, 1 m along x, beside it."""
    lines = [flaser(500.0 + 0.2 * n, np.full(180, 81.91), Pose2D(0.04 * n, 0.0)) for n in range(26)]
    (tmp_path / "drive.clf.gz").write_bytes(gzip.compress("".join(lines).encode()))
    (tmp_path / "log.yaml").write_text(MISSION)
    return tmp_path


def test_a_mission_runs_on_a_log_and_stands_after_its_end(folder):
    report = missions.run(folder / "log.yaml", out=folder / "run")
    assert (report.status, report.reason) == ("interrupted", "the recording is over")
    assert report.simulated_seconds == pytest.approx(7.0, abs=0.2)  # 5 s of log, 2 s of rest
    assert report.robot == "drive"
    assert report.final_pose["estimate"]["x"] == pytest.approx(1.0, abs=1e-6)
    assert [e.text for e in read_events(folder / "run/events.jsonl") if e.kind == "say"] == ["here"]


def test_the_log_of_set_is_relative_to_the_current_folder(folder, monkeypatch):
    elsewhere = folder / "elsewhere"
    elsewhere.mkdir()
    (folder / "drive.clf.gz").rename(elsewhere / "other.clf.gz")
    monkeypatch.chdir(elsewhere)
    report = missions.run(folder / "log.yaml", arguments={"log": "other.clf.gz", "rest": "20 s"})
    assert report.status == "success"
    assert report.robot == "other"


def test_arguments_reach_components_and_wrong_names_are_errors(folder):
    found = diagnose(folder / "log.yaml", RunOptions(arguments={"range": "2.5"}))
    assert found.findings == ()
    assert found.plan.choices["costmap"].parameters.obstacle_range == 2.5
    text = MISSION.replace("$range", "$reach").replace("use: replayed", "use: replayd")
    (folder / "log.yaml").write_text(text)
    sentences = [str(item) for item in diagnose(folder / "log.yaml").findings]
    assert any("$reach: values at the top of a mission refer to its" in s for s in sentences)
    assert any("write `use: replayed`" in s for s in sentences)


def test_a_foreign_log_replaces_the_sensors_of_the_robot_with_replay(folder):
    (folder / "drive.yaml").write_text(
        "mission: m\nrobot: scout\nworld: small_room\nmap: none\nrun: {wait: {time: 2 s}}\n"
    )
    report = missions.run(folder / "drive.yaml", replay=folder / "drive.clf.gz")
    assert (report.status, report.robot) == ("success", "drive")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("nowhere.clf.gz", None, "there is no such log; did you mean 'drive.clf.gz'?"),
        ("bad.clf", b"FLASER 3 1.0\nODOM 0 0 0 0 0 0 1 h 1\n", "bad.clf:1:1 error[E502]"),
        ("bag.mcap", b"\x89MCAP0\r\n\x01\x09", "bag.mcap"),
        ("notes.txt", b"hello\n", "error[E501] this is not a CARMEN log"),
    ],
)
def test_wrong_logs_end_with_exit_code_2(folder, monkeypatch, name, content, words):
    monkeypatch.chdir(folder)
    if content is not None:
        (folder / name).write_bytes(content)
    result = CliRunner().invoke(app, ["check", "log.yaml", "--set", f"log={name}"])
    assert result.exit_code == 2
    assert words in result.output


def test_a_replayed_mission_needs_no_world_but_a_driving_one_does(folder):
    text = MISSION.replace("{use: replayed, log: $log, after: $rest}", "scout")
    (folder / "log.yaml").write_text(text)
    sentences = [item.sentence for item in diagnose(folder / "log.yaml").findings]
    assert any("world" in sentence for sentence in sentences)
    (folder / "log.yaml").write_text(MISSION + "map: from_world\n")
    sentences = [item.sentence for item in diagnose(folder / "log.yaml").findings]
    assert sentences == ["map: from_world needs a `world`"]


MAPPING = """
mission: map a log
robot: {use: replayed, log: drive.clf.gz}
map: none
localisation: slam
run:
  sequence:
    - wait_until: recording.over
    - save_map: {path: map}
"""


def test_a_recording_whose_scans_show_nothing_fails_with_the_reason(folder):
    """All 26 scans read 81.91 m, the code for no return: no wall was seen."""
    (folder / "map.yaml").write_text(MAPPING)
    report = missions.run(folder / "map.yaml", out=folder / "run")
    assert report.status == "failure" and not (folder / "run" / "map").exists()
    assert "nothing is mapped: none of 26 scans of lidar shows a wall within 30 m" in report.reason


@pytest.mark.parametrize("late", [None, 60.0], ids=["not measured", "of another clock"])
def test_a_recording_whose_scans_cannot_be_used_fails_with_the_reason(folder, late):
    """The log is replaced by scans that never come, or come with stamps a minute in the past."""
    (folder / "map.yaml").write_text(MAPPING)
    options = RunOptions(serve=False, out=folder / "run")
    plan = prepare(folder / "map.yaml", options)

    def observed():
        for k in range(100):
            now = 61.0 + 0.05 * k
            ranges = np.full(180, 2.0 - 0.01 * k, np.float32)
            scan = Scan(now - (late or 0.0), ranges, -1.5, 0.017, 0.0, 80.0)
            wheels = Odometry(now, Pose2D(0.01 * k, 0.0), Twist(0.2, 0.0))
            yield Observation(now, {"wheels": wheels} | ({} if late is None else {"lidar": scan}))

    run = Run(replace(plan, recording=replace(plan.recording, play=observed)), options)
    try:
        run_in_turns([run])
    finally:
        run.close()
    assert run.report.status == "failure"
    assert "nothing is mapped: no scan of lidar could be used" in run.report.reason
    # in the first second old stamps are taken for those of before the begin
    assert run.report.scans_dropped == ({} if late is None else {"lidar": 79})
