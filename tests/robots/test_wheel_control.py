"""Wheels that the loop controls by torques in the physics, with the gains of the robot file."""

from dataclasses import replace
from pathlib import Path

import pytest

from robots.load import find_robot, read_robot
from stack.drivetrain.wheel_loop import WheelGains
from stack.types import Twist
from tests.stack.sim.sim_rover import drive

GAINS = WheelGains(p=0.4, i=2.0, most=5.0)


def robot(name, gains=GAINS):
    return replace(read_robot(find_robot(name, Path())), wheel_control=gains)


@pytest.mark.parametrize("name", ["scout", "glide", "buggy", "jackal"])
def test_torques_bring_the_robot_to_its_speed_and_hold_it(build, name):
    body = build(robot(name))
    drive(body, Twist(0.4), 3.0)
    assert body.truth.twist.linear == pytest.approx(0.4, rel=0.01)
    drive(body, Twist(), 3.0)
    before = body.truth.pose
    drive(body, Twist(), 2.0)
    after = body.truth.pose
    assert abs(after.x - before.x) < 5e-3
    assert abs(after.heading - before.heading) < 5e-3


def test_the_turn_of_a_skid_steered_robot_is_controlled_at_its_real_wheels(build):
    plain, controlled = build(robot("jackal", WheelGains())), build(robot("jackal"))
    for body in (plain, controlled):
        drive(body, Twist(0.4, 0.4), 4.0)
    assert controlled.truth.twist.angular == pytest.approx(
        plain.truth.twist.angular, rel=0.15
    )  # the sliding varies along the way


def test_too_little_torque_is_too_slow(build):
    """The effort is limited to 0.01 N m a wheel: 2 x 0.01 / 0.075 N for the whole robot."""
    body = build(robot("scout", replace(GAINS, most=0.01)))
    drive(body, Twist(0.4), 2.0)
    assert 0.0 < body.truth.twist.linear < 0.2


def test_the_robot_file_has_the_gains(tmp_path):
    folder = find_robot("scout", Path()).parent
    text = (folder / "robot.yaml").read_text().replace("scout.urdf", str(folder / "scout.urdf"))
    (tmp_path / "robot.yaml").write_text(f"{text}\nwheel_control: {{p: 0.4, i: 2, most: 5}}\n")
    assert read_robot(tmp_path / "robot.yaml").wheel_control == GAINS
