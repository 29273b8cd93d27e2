"""The fit of radii, track and gyro on drives without noise, where the answer is exact."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from missions.commissioning.odometry_fit import Model, fit_odometry
from missions.commissioning.recording import Drive, Track
from missions.commissioning.segments import chained
from missions.execution.resources import load_robot
from stack.errors import InputError

STRAIGHT, LEFT, RIGHT = (0.02, 0.0, 0.0), (0.0, 0.0, 0.03), (0.0, 0.0, -0.03)
ARC, OTHER_ARC = (0.02, 0.0, 0.025), (0.02, 0.0, -0.025)
SIDEWAYS = (0.0, 0.02, 0.0)


def drive_of(robot, motions, *, factors, gyro_scale=1.0, gyro_offset=0.0):
    """A drive whose true displacements are `motions`, by (motion, number of steps of 50 ms)."""
    true = np.concatenate([np.tile(motion, (steps, 1)) for motion, steps in motions])
    stamps = 0.05 * np.arange(len(true) + 1)
    # what the described wheels report: the inverse of what the fit has to find
    reported = true @ np.linalg.pinv(Model(robot).correction(np.array(factors))).T
    turned = np.concatenate([[0.0], np.cumsum(true[:, 2])])
    gyro = np.column_stack([stamps, turned / gyro_scale + gyro_offset * stamps])
    return Drive(robot, Track(stamps, chained(reported)), gyro, Track(stamps, chained(true)))


def estimates(fit):
    return {estimate.label: estimate for estimate in fit.estimates}


SQUARE = [(STRAIGHT, 100), (LEFT, 52), (STRAIGHT, 100), (RIGHT, 104), (LEFT, 210), (RIGHT, 210)]


@pytest.mark.parametrize(
    ("name", "factors", "motions"),
    [
        ("scout", (0.95, 0.96, 1.03), SQUARE * 4),
        ("jackal", (1.05, 1.04, 0.97), SQUARE * 4),
        ("glide", (0.95, 0.97, 1.04, 1.03), [*SQUARE, (SIDEWAYS, 100)] * 12),
        ("buggy", (0.95, 1.03), [(STRAIGHT, 100), (ARC, 250), (OTHER_ARC, 250)] * 4),
    ],
)
def test_every_kind_of_drive_is_fitted_exactly(name, factors, motions):
    robot = load_robot(name, Path.cwd())
    fit = fit_odometry(drive_of(robot, motions, factors=factors))
    lengths = [e for e in fit.estimates if e.unit == "m"]
    found = [e.value / e.before for e in lengths]
    assert found == pytest.approx(factors, abs=1e-4)  # the weak prior pulls by 1e-5
    assert max(fit.after) < 1e-4 < min(fit.before[[0, 2]])
    assert fit.wheels.turning_length == pytest.approx(
        factors[-1] * robot.wheels.turning_length, rel=1e-4
    )
    # the robot file gets the radii of all wheels, and they are those of the drive
    values = fit.values
    assert len(values["wheels", "effective_radii"].split(",")) == robot.drivetrain.encoders


def test_scale_and_offset_of_the_gyro_are_fitted():
    robot = load_robot("scout", Path.cwd())
    drive = drive_of(robot, SQUARE * 4, factors=(1.0, 1.0, 1.0), gyro_scale=1.02, gyro_offset=0.004)
    found = estimates(fit_odometry(drive))
    assert found["gyro scale"].value == pytest.approx(1.02, abs=1e-4)
    assert found["gyro offset"].value == pytest.approx(0.004, abs=1e-4)


def test_what_the_drive_does_not_determine_is_not_written():
    robot = load_robot("scout", Path.cwd())
    wrong = {"factors": (0.95, 0.95, 1.03)}
    straight = fit_odometry(drive_of(robot, [(STRAIGHT, 4000)], **wrong))
    track = estimates(straight)["effective track"]
    assert not track.is_determined and track.missing.startswith("turns to both sides: 0.0 turns")
    assert ("wheels", "effective_track") not in straight.values
    spinning = fit_odometry(drive_of(robot, [(LEFT, 3000), (RIGHT, 3000)], **wrong))
    radius = estimates(spinning)["left radius"]
    assert not radius.is_determined and radius.missing == "straight drives: 0.0 m so far"
    assert ("wheels", "effective_radii") not in spinning.values


def test_a_push_does_not_move_the_result():
    robot = load_robot("scout", Path.cwd())
    drive = drive_of(robot, SQUARE * 6, factors=(0.95, 0.95, 1.03))
    poses = drive.reference.poses.copy()
    poses[1500:, :2] += (0.4, -0.2)  # the robot is moved sideways, and its wheels do not notice
    pushed = replace(drive, reference=Track(drive.reference.stamps, poses))
    found = [e.value / e.before for e in fit_odometry(pushed).estimates if e.unit == "m"]
    assert found == pytest.approx((0.95, 0.95, 1.03), abs=3e-3)


def test_a_short_drive_is_refused():
    robot = load_robot("scout", Path.cwd())
    with pytest.raises(InputError, match="at least 12 are needed"):
        fit_odometry(drive_of(robot, [(STRAIGHT, 100)], factors=(1.0, 1.0, 1.0)))
