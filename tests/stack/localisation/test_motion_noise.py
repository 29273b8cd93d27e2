"""Spread of the particles by odometry, for differential and omnidirectional robots."""

from math import pi

import numpy as np
import pytest

from stack.drivetrain.description import ImuDescription
from stack.localisation.fusion.wheels_gyro import WheelGyroOdometry
from stack.localisation.parameters import OdometryFusionParameters
from stack.localisation.particles import MotionNoise, OmniMotionNoise, move
from stack.types import Imu, Odometry, Pose2D, Twist
from tests.observed import observed
from tests.stack.sim.sim_rover import ROVER

ALPHAS = 0.01, 0.01, 0.02, 0.001
START = np.tile([1.0, 2.0, 0.5], (20_000, 1))


def spread(noise, moved):
    """Deviations along x, y of the start's frame and of the heading, about where it should be."""
    generator = np.random.default_rng(1)
    after = noise.sample(START, moved, generator) - move(START, moved)
    c, s = np.cos(0.5), np.sin(0.5)
    return (
        np.std(c * after[:, 0] + s * after[:, 1]),
        np.std(c * after[:, 1] - s * after[:, 0]),
        np.std(after[:, 2]),
    )


def test_a_step_sideways_does_not_blur_the_heading():
    sideways = Pose2D(0.0, 0.1)
    x, y, heading = spread(OmniMotionNoise(*ALPHAS, 0.03), sideways)
    assert y == pytest.approx(0.02**0.5 * 0.1, rel=0.03)  # along the motion
    assert x == pytest.approx(0.03**0.5 * 0.1, rel=0.03)  # across it
    assert heading == pytest.approx(0.01**0.5 * 0.1, rel=0.03)
    # Turn, go, turn: two quarter turns of deviation 0.1 * pi / 2 each.
    assert spread(MotionNoise(*ALPHAS), sideways)[2] > 0.2


def test_a_step_ahead_and_a_turn_in_place_are_as_for_differential_robots():
    for moved in (Pose2D(0.1, 0.0), Pose2D(0.0, 0.0, pi / 6)):
        x, _, heading = spread(OmniMotionNoise(*ALPHAS, 0.02), moved)
        usual_x, _, usual = spread(MotionNoise(*ALPHAS), moved)
        assert x == pytest.approx(usual_x, rel=0.05, abs=1e-9)
        assert heading <= usual * 1.03


def test_the_mean_of_the_particles_follows_odometry():
    moved = Pose2D(0.05, -0.08, 0.1)
    after = OmniMotionNoise(*ALPHAS, 0.02).sample(START, moved, np.random.default_rng(2))
    assert after.mean(axis=0) == pytest.approx(move(START[:1], moved)[0], abs=1e-3)


def test_the_fusion_turns_a_sideways_arc_by_the_gyro():
    """Wheels say straight to the left, the gyro says a quarter turn: a quarter circle sideways."""
    fusion = WheelGyroOdometry(OdometryFusionParameters(), ROVER)
    rate = ImuDescription().rate
    fusion.update(observed(0.0, Odometry(0.0, Pose2D(0.0, 0.0), Twist())))
    for n in range(1, 101):
        stamps = (n - 1) * 0.02 + np.arange(1, 3) / rate
        gyro = np.zeros((2, 3))
        gyro[:, 2] = pi / 4
        wheels = Odometry(0.02 * n, Pose2D(0.0, pi / 4 * 0.02 * n), Twist(0.0, 0.0, pi / 4))
        fused = fusion.update(observed(0.02 * n, wheels, imu=Imu(stamps, gyro, np.zeros((2, 3)))))
    pose = fused.pose
    assert (pose.x, pose.y, pose.heading) == pytest.approx((-1.0, 1.0, pi / 2), abs=1e-3)
    assert fused.twist.lateral == pytest.approx(pi / 4)
