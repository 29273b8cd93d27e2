"""A signed link to the emulated rover, in real time: the same key on both sides, others, none."""

import os

import pytest

from robots.mavlink.body import MavlinkBody
from robots.mavlink.parameters import MavlinkParameters
from stack.errors import BodyError, InputError
from stack.mavlink.signing import make_key, read_key
from stack.types import Twist
from tests.robots.mavlink.test_driving import drive

SOON = {"connect_timeout": 1.5, "arm_timeout": 6.0}


@pytest.fixture
def key(tmp_path):
    path = tmp_path / "robot.key"
    make_key(path)
    return path


def test_both_sides_sign_and_the_rover_drives_also_after_a_restart(emulated, bodies, key):
    rover = emulated(key=read_key(key), refuses_arming=0)
    for _ in range(2):  # the second body begins with the stamps that the first has left
        before = rover.driven
        body = bodies(key=str(key), **SOON)
        drive(body, Twist(0.5), 1.0)
        assert body.health.problem == ""
        assert rover.driven > before + 0.2
        body.close()
        assert not rover.armed
    assert "BAD_DATA" not in rover.received
    assert sorted(os.listdir(key.parent)) == ["robot.key", "robot.key.body.stamp"]


@pytest.mark.parametrize("signs", [True, False], ids=["another key", "no key"])
def test_a_rover_without_the_key_of_the_body_is_refused(emulated, bodies, key, tmp_path, signs):
    make_key(tmp_path / "other.key")
    rover = emulated(key=read_key(tmp_path / "other.key") if signs else None, refuses_arming=0)
    with pytest.raises(
        BodyError, match=r"no heartbeat of a rover on .*; \d+ frames were not signed"
    ):
        bodies(key=str(key), **SOON)
    assert not rover.armed and not rover.setpoints


def test_a_body_without_the_key_of_the_rover_says_what_is_missing(emulated, bodies, key):
    rover = emulated(key=read_key(key), refuses_arming=0)
    with pytest.raises(BodyError, match="refuses ours; set `key` of the body"):
        bodies(**SOON)
    assert not rover.armed and set(rover.received) <= {"BAD_DATA"}


def test_the_key_is_beside_the_robot_file_and_for_its_owner_only(description, tmp_path, key):
    from dataclasses import replace

    robot = replace(description, source=tmp_path / "robot.yaml")
    with pytest.raises(InputError, match=f"{tmp_path}/none.key cannot be read"):
        MavlinkBody(robot, MavlinkParameters(key="none.key"))
    key.chmod(0o644)
    with pytest.raises(InputError, match="chmod 600"):
        MavlinkBody(robot, MavlinkParameters(key=key.name))
    assert MavlinkParameters("udpin:0.0.0.0:14550", key="robot.key").key
    with pytest.raises(InputError, match=r"0\.0\.0\.0"):
        MavlinkParameters("udpin:0.0.0.0:14550")
