"""Spread of the particles by odometry, for differential and omnidirectional robots."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.drivetrain.description import ImuDescription
from stack.localisation.fusion.wheels_gyro import WheelGyroOdometry
from stack.localisation.parameters import OdometryFusionParameters
from stack.localisation.particle_filter import motion_models
from stack.localisation.particle_filter.motion_models import (
    CarMotionNoise,
    MotionNoise,
    OmniMotionNoise,
    disturb,
    motion_model,
)
from stack.localisation.particle_filter.particles import move
from stack.types import Imu, Odometry, Pose2D, Twist
from tests.observed import observed
from tests.stack.navigation.toy_world import moving
from tests.stack.sim.sim_rover import ROVER

SLIP, SLIDING = 0.02, 0.02 * 3.0**0.5

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


def test_a_step_sideways_does_not_blur_the_heading(monkeypatch):
    monkeypatch.setattr(motion_models, "ALPHAS", (25.0, 25.0, 50.0, 2.5, 75.0))
    sideways = Pose2D(0.0, 0.1)
    x, y, heading = spread(OmniMotionNoise(SLIP), sideways)
    assert y == pytest.approx(0.02**0.5 * 0.1, rel=0.03)  # along the motion
    assert x == pytest.approx(0.03**0.5 * 0.1, rel=0.03)  # across it
    assert heading == pytest.approx(0.01**0.5 * 0.1, rel=0.03)
    # Turn, go, turn: two quarter turns of deviation 0.1 * pi / 2 each.
    assert spread(MotionNoise(SLIP), sideways)[2] > 0.2


def test_a_step_ahead_and_a_turn_in_place_are_as_for_differential_robots():
    for moved in (Pose2D(0.1, 0.0), Pose2D(0.0, 0.0, pi / 6)):
        x, _, heading = spread(OmniMotionNoise(SLIP), moved)
        usual_x, _, usual = spread(MotionNoise(SLIP), moved)
        assert x == pytest.approx(usual_x, rel=0.05, abs=1e-9)
        assert heading <= usual * 1.03


def test_turning_blurs_skid_steered_robots_more():
    """The sliding has three times the variance of the slip: in all the deviation is doubled."""
    turn = Pose2D(0.0, 0.0, 0.5)
    usual, skid = (spread(MotionNoise(SLIP, sliding), turn) for sliding in (0.0, SLIDING))
    assert skid[2] == pytest.approx(2.0 * usual[2], rel=0.05)
    ahead = Pose2D(0.5, 0.0)
    assert spread(MotionNoise(SLIP, SLIDING), ahead)[2] == pytest.approx(
        spread(MotionNoise(SLIP), ahead)[2], rel=0.05
    )


def test_a_car_does_not_turn_without_driving():
    noise = CarMotionNoise(SLIP)
    assert spread(noise, Pose2D(0.0, 0.0, 0.3)) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    x, y, heading = spread(noise, Pose2D(0.2, 0.0))
    assert x == pytest.approx(0.02**0.5 * 0.2, rel=0.03)
    assert heading == pytest.approx(0.01**0.5 * 0.2, rel=0.03)
    # the chord of an arc leaves by half of its turn
    assert y == pytest.approx(0.2 * heading / 2.0, rel=0.05)


@pytest.mark.parametrize(
    ("kind", "model"),
    [("diff", MotionNoise), ("omni", OmniMotionNoise), ("ackermann", CarMotionNoise)],
)
def test_each_drive_has_its_motion_model(kind, model):
    assert isinstance(motion_model(moving(kind)), model)


@settings(deadline=None, max_examples=30)
@given(st.floats(0.0, 0.3), st.floats(0.0, 0.3), st.floats(0.0, 0.2), st.floats(-pi, pi))
def test_a_stated_error_spreads_the_particles_by_its_covariance(x, y, heading, at):
    """In the frame of each pose at the start of the motion; 20 000 draws: 2 %."""
    poses = np.tile([1.0, 2.0, at], (20_000, 1))
    after = disturb(
        poses, poses[:, 2], np.diag(np.square([x, y, heading])), np.random.default_rng(3)
    )
    off = after - poses
    c, s = np.cos(at), np.sin(at)
    along, across = c * off[:, 0] + s * off[:, 1], c * off[:, 1] - s * off[:, 0]
    found = np.std(along), np.std(across), np.std(off[:, 2])
    assert found == pytest.approx((x, y, heading), rel=0.03, abs=1e-9)


def test_the_mean_of_the_particles_follows_odometry():
    moved = Pose2D(0.05, -0.08, 0.1)
    after = OmniMotionNoise(SLIP).sample(START, moved, np.random.default_rng(2))
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
