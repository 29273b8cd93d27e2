"""Stated error of odometry by wheels alone: closed form, and the drift of simulated wheels."""

from dataclasses import replace

import numpy as np
import pytest

from stack.drivetrain.description import OdometryNoise
from stack.drivetrain.differential import Wheels
from stack.localisation.fusion.wheels_gyro import WheelGyroOdometry, WheelSlip
from stack.sim.sensors.odometry import Odometry as SimulatedOdometry
from stack.types import Imu, Odometry, Pose2D, Twist
from tests.observed import observed
from tests.stack.navigation.toy_world import moving
from tests.stack.sim.sim_rover import ROVER

NARROW = replace(
    ROVER,
    wheels=Wheels(("l",), ("r",), radius=0.033, separation=0.135),
    odometry=OdometryNoise(scale_error=0.0, slip=0.02, ticks_per_turn=1 << 20),
)


@pytest.mark.parametrize("separation", [0.135, 0.3, 0.6])
def test_a_narrow_robot_is_less_sure_of_its_heading(separation):
    drivetrain = replace(ROVER, wheels=replace(NARROW.wheels, separation=separation)).drivetrain
    slip = WheelSlip(drivetrain, 0.02)
    straight, turn = slip.covariance(Pose2D(-2.0, 0.0)), slip.covariance(Pose2D(0.0, 0.0, -1.0))
    # Two wheels of 2 m each; in place each rolls half of the separation for one radian.
    assert straight[2, 2] == pytest.approx(2 * 0.02**2 * 2.0 / separation**2)
    assert straight[0, 0] == pytest.approx(0.02**2 * 2.0 / 2)
    assert turn[2, 2] == pytest.approx(2 * 0.02**2 * (separation / 2) / separation**2)


def test_a_drift_of_simulated_wheels_is_as_stated():
    ends = []
    for seed in range(200):
        wheels = SimulatedOdometry(NARROW, seed)
        for n in range(41):
            wheels.update(0.01 * n, (n / 0.033 / 40, n / 0.033 / 40))
        ends.append(wheels.reading.pose.heading)
    stated = WheelSlip(NARROW.drivetrain, 0.02).covariance(Pose2D(1.0, 0.0))
    # The deviation of 200 samples is within 5 % (one sigma); 0.02 sqrt(2) / 0.135 = 0.21 rad.
    assert np.std(ends) == pytest.approx(stated[2, 2] ** 0.5, rel=0.15)


@pytest.mark.parametrize("kind", ["omni", "ackermann"])
def test_every_drive_states_a_heading_error(kind):
    covariance = WheelSlip(moving(kind).drivetrain, 0.02).covariance(Pose2D(1.0, 0.0))
    assert covariance[2, 2] > 0.0
    assert np.linalg.eigvalsh(covariance)[0] > -1e-15


def test_errors_are_stated_only_while_no_gyro_measures():
    fusion = WheelGyroOdometry(WheelGyroOdometry.Parameters(gyro_timeout=0.2), NARROW)
    stated = []
    for step in range(10):
        now = 0.05 * step
        wheels = Odometry(now, Pose2D(0.02 * step, 0.0), Twist(0.4))
        samples = Imu(np.array([now]), np.zeros((1, 3)), np.tile([0.0, 0.0, 9.81], (1, 1)))
        fused = fusion.update(observed(now, wheels, imu=samples if step < 4 else None))
        stated.append(fused.step_covariance[2, 2])
    assert stated[:4] == [0.0] * 4
    assert stated[-1] == pytest.approx(2 * 0.02**2 * 0.02 / 0.135**2)
