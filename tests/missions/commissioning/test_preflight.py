"""Preflight checks: what is wrong is found and named, and nothing else is."""

import json
import subprocess
import sys
from dataclasses import replace
from math import pi

import pytest
from typer.testing import CliRunner

import treepilot
from missions.cli.app import app
from missions.commissioning.checks import failures
from missions.commissioning.preflight import preflight
from stack.errors import BodyError
from stack.types import STANDSTILL, Pose2D
from tests.missions.commissioning.bodies import (
    Altered,
    low_battery,
    restamped,
    scripted,
    silent,
    simulated,
    turned_gyro,
)


def failed_checks(body, confirms=None):
    try:
        return {check.name: check for check in failures(preflight(body, confirms))}
    finally:
        body.close()


@pytest.mark.parametrize("make", [simulated, scripted])
def test_a_sound_robot_passes(make):
    assert failed_checks(make()) == {}


@pytest.mark.parametrize(
    ("alter", "name", "found"),
    [
        (silent("lidar"), "lidar rate", "silent"),
        (silent("imu"), "imu rate", "silent"),
        (restamped("lidar", lambda stamp: stamp - 5.0), "lidar clock", "5050 to 5050 ms old"),
        (restamped("lidar", lambda stamp: stamp + 1.0), "lidar clock", "in the future"),
        (restamped("lidar", lambda _: 0.25), "lidar clock", "stand still at 0.25 s"),
        (restamped("front", lambda stamp: 0.9 * stamp), "front clock", "10 % slow"),
        (low_battery, "battery", "8%"),
    ],
)
def test_a_fault_is_found_and_named(alter, name, found):
    wrong = failed_checks(Altered(simulated(), alter))
    assert set(wrong) == {name}
    assert found in wrong[name].found and wrong[name].remedy


@pytest.mark.parametrize("make", [simulated, scripted])
def test_a_sound_robot_passes_the_checks_with_motion(make):
    body = make()
    assert failed_checks(body, lambda _: True) == {}


def backwards():
    """A scout whose lidar is mounted with its plug to the front."""
    sound = simulated()
    actual = sound.description
    sound.close()
    turned = replace(actual.lidar, mount=Pose2D(0.0, 0.0, pi))
    return simulated(replace(actual, lidar=turned, actual=actual))


def upside_down(name, measured):
    return replace(measured, ranges=measured.ranges[::-1]) if name == "lidar" else measured


def reversed_encoders(name, measured):
    if name != "wheels":
        return measured
    return replace(measured, pose=measured.pose.inverse())


@pytest.mark.parametrize(
    ("make", "wrong"),
    [
        (lambda: Altered(simulated(), turned_gyro), {"turn: imu"}),
        (backwards, {"forward: lidar"}),
        (lambda: Altered(simulated(), upside_down), {"turn: lidar"}),
        (lambda: Altered(simulated(), reversed_encoders), {"turn: wheels", "forward: wheels"}),
    ],
)
def test_a_wrong_sign_is_found_by_a_small_motion(make, wrong):
    assert set(failed_checks(make(), lambda _: True)) == wrong


def test_nothing_moves_without_room_or_confirmation_or_after_a_failure():
    close = simulated(start=Pose2D(0.3, 0.3, 0.0))
    assert set(failed_checks(close, lambda _: True)) == {"free space"}
    for body, confirms in (
        (scripted(), lambda _: False),
        (Altered(scripted(), low_battery), lambda _: True),
    ):
        made = list(preflight(body, confirms))
        assert made[-1].name == "motion" and made[-1].outcome == "skipped"
        inner = getattr(body, "body", body)
        assert not any(command.twist != STANDSTILL for command in inner.commands)


def test_the_emergency_stop_is_waited_for():
    pressed = scripted()
    pressed._problems = ((12.0, "emergency stop pressed"),)
    made = {c.name: c for c in preflight(pressed, lambda _: True, estop=True)}
    assert made["emergency stop"].outcome == "passed"
    broken = {c.name: c for c in preflight(scripted(), lambda _: True, estop=True)}
    assert broken["emergency stop"].outcome == "failed"


def test_a_mission_on_a_real_robot_begins_with_the_checks(tmp_path):
    mission = tmp_path / "stand.yaml"
    mission.write_text(
        "mission: stand\nformat: 1\nrobot: scout\nworld: small_room\nrun: {wait: 1 s}\n"
    )
    refused = Altered(simulated(), silent("lidar"), real_time=True)
    with pytest.raises(BodyError, match="preflight failed: lidar rate: silent"):
        treepilot.run(mission, body=lambda _: refused)
    sound = Altered(simulated(), lambda _, measured: measured, real_time=True)
    assert treepilot.run(mission, body=lambda _: sound, out=tmp_path / "run").status == "success"
    (event,) = preflight_events(tmp_path / "run")
    assert event["text"] == f"preflight: {len(event['fields']['checks'])} checks, none failed"
    assert {"lidar rate", "battery"} <= {check["name"] for check in event["fields"]["checks"]}


def preflight_events(folder):
    lines = (folder / "events.jsonl").read_text().splitlines()
    return [event for event in map(json.loads, lines) if event["kind"] == "preflight"]


def test_a_failed_check_is_in_the_log_and_may_be_skipped(tmp_path):
    """Commands as a user gives them, on wheels that are emulated, with a lidar that is silent."""
    mission = tmp_path / "stand.yaml"
    mission.write_text(
        "mission: stand\nformat: 1\nrobot: scout\nworld: small_room\n"
        "localisation: dead_reckoning\nrun: {wait: 0.2 s}\n"
    )
    words = [sys.executable, "-m", "treepilot", "run", mission, "--body", "wheels", "--headless"]
    refused = subprocess.run([*words, "--out", tmp_path / "a"], capture_output=True, text=True)
    assert refused.returncode == 3
    assert "preflight failed: lidar rate: silent for 3.0 s" in refused.stderr
    assert "--skip-preflight" in refused.stderr
    (event,) = preflight_events(tmp_path / "a")
    failed = {c["name"] for c in event["fields"]["checks"] if c["outcome"] == "failed"}
    assert event["level"] == "error" and {"lidar rate", "imu rate"} <= failed
    skips = [*words, "--out", tmp_path / "b", "--skip-preflight"]
    assert subprocess.run(skips, capture_output=True).returncode == 0
    (event,) = preflight_events(tmp_path / "b")
    assert event["text"] == "preflight skipped (--skip-preflight)"


def test_the_command_lists_the_checks_and_exits_with_1_when_one_fails():
    passed = CliRunner().invoke(app, ["preflight", "scout", "--no-motion", "--json"])
    result = json.loads(passed.output)
    assert passed.exit_code == 0 and result["passed"]
    assert {"name", "outcome", "found", "remedy"} == set(result["checks"][0])
    # a robot that delivers no inertial samples, as the scripted scout
    failing = CliRunner().invoke(app, ["preflight", "scout", "--body", "scripted"])
    assert failing.exit_code == 1
    assert "✘ imu rate: silent for 3.0 s\n    check power and cable of imu" in failing.output
    assert "· motion: a robot that fails a check does not move" in failing.output
    assert "scout is not ready: 1 of " in failing.output
