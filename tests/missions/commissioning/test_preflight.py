"""Preflight checks: what is wrong is found and named, and nothing else is."""

import pytest

import treepilot
from missions.commissioning.checks import failures
from missions.commissioning.preflight import preflight
from stack.errors import BodyError
from tests.missions.commissioning.bodies import (
    Altered,
    low_battery,
    restamped,
    scripted,
    silent,
    simulated,
)


def failed_checks(body):
    try:
        return {check.name: check for check in failures(preflight(body))}
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


def test_a_mission_on_a_real_robot_begins_with_the_checks(tmp_path):
    mission = tmp_path / "stand.yaml"
    mission.write_text(
        "mission: stand\nformat: 1\nrobot: scout\nworld: small_room\nrun: {wait: 1 s}\n"
    )
    refused = Altered(simulated(), silent("lidar"), real_time=True)
    with pytest.raises(BodyError, match="preflight failed: lidar rate: silent"):
        treepilot.run(mission, body=lambda _: refused)
    sound = Altered(simulated(), lambda _, measured: measured, real_time=True)
    assert treepilot.run(mission, body=lambda _: sound).status == "success"
