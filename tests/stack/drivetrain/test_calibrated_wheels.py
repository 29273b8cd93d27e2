"""Calibrated radii and lengths: commands and odometry use the same ones."""

from pathlib import Path

import pytest

from robots.load import find_robot, read_robot
from stack.drivetrain.drivetrain import DriveState
from stack.types import Twist

HERE = Path(__file__).parent


@pytest.mark.parametrize("name", ["scout", "jackal", "glide"])
def test_a_command_is_what_calibrated_odometry_measures(name):
    robot = read_robot(find_robot(name, HERE))
    plain = robot.drivetrain
    radii = [1.03 * plain.radii[0], *(0.98 * radius for radius in plain.radii[1:])]
    wheels = robot.wheels.calibrated(radii, 1.07 * robot.wheels.turning_length)
    drive = wheels.drivetrain(robot.limits)
    twist = drive.feasible(Twist(0.4, 0.6, 0.2))
    angles = drive.encoder_angles(drive.to_wheels(DriveState(twist)).speeds)
    rolled = [angle * radius for angle, radius in zip(angles, drive.radii, strict=True)]
    moved = drive.from_wheels(rolled, [0.0] * len(rolled))
    expected = (twist.linear, twist.lateral, twist.angular)
    assert (moved.x, moved.y, moved.heading) == pytest.approx(expected, abs=1e-12)
    # with the lengths of the data sheet the same angles are another motion
    unaware = plain.from_wheels(
        [angle * radius for angle, radius in zip(angles, plain.radii, strict=True)],
        [0.0] * len(rolled),
    )
    assert abs(unaware.heading - twist.angular) > 0.01


def test_a_calibrated_car_steers_for_its_effective_wheelbase():
    robot = read_robot(find_robot("buggy", HERE))
    wheels = robot.wheels.calibrated([0.081, 0.081], 0.46)
    drive = wheels.drivetrain(robot.limits)
    command = drive.to_wheels(DriveState(Twist(0.5, 0.3)))
    rolled = [speed * 0.081 for speed in command.speeds]
    moved = drive.from_wheels(rolled, [0.0, 0.0], command.steering)
    assert (moved.x, moved.heading) == pytest.approx((0.5, 0.3), abs=1e-12)
    assert drive.turning_radius == pytest.approx(0.46 / 0.44 * robot.drivetrain.turning_radius)
