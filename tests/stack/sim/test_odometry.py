from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.description import OdometryNoise, Wheels
from stack.sim.odometry import Encoders, Odometry
from tests.stack.sim.sim_rover import ROVER

WHEELS = Wheels(("l",), ("r",), radius=0.1, separation=0.4)
PERFECT = OdometryNoise(scale_error=0.0, slip=0.0, ticks_per_turn=1 << 20)


def odometry_of(noise, seed=1):
    return Odometry(replace(ROVER, wheels=WHEELS, odometry=noise), seed)


def roll(odometry, left, right, readings=200):
    """Turn the wheels to these angles in equal parts, 10 ms each."""
    for n in range(readings + 1):
        odometry.update(0.01 * n, Encoders((left * n / readings, right * n / readings)))
    return odometry.reading


def test_perfect_wheels_follow_the_circle():
    # Quarter turn to the left on a 1 m circle: wheels roll (1 -+ 0.2) pi / 2 metres.
    reading = roll(odometry_of(PERFECT), 0.8 * pi / 2 / 0.1, 1.2 * pi / 2 / 0.1)
    pose = reading.pose
    assert (pose.x, pose.y, pose.heading) == pytest.approx((1.0, 1.0, pi / 2), abs=1e-4)
    assert reading.twist.linear == pytest.approx(pi / 2 / 2.0, rel=1e-3)
    assert reading.twist.angular == pytest.approx(pi / 2 / 2.0, rel=1e-3)


def test_encoders_round_down_to_whole_ticks():
    coarse = OdometryNoise(scale_error=0.0, slip=0.0, ticks_per_turn=16)
    turn = 2 * pi / 16
    reading = roll(odometry_of(coarse), 2.9 * turn, 2.9 * turn, readings=1)
    assert reading.pose.x == pytest.approx(2 * turn * 0.1)


def test_slip_grows_with_the_root_of_the_distance():
    noise = OdometryNoise(scale_error=0.0, slip=0.02, ticks_per_turn=1 << 20)
    ends = [roll(odometry_of(noise, seed), 40.0, 40.0).pose.heading for seed in range(200)]
    # Two wheels over 4 m: deviation sqrt(2 * 4) * 0.02 / 0.4 = 0.141 rad; 200 samples: +-5 %.
    assert np.std(ends) == pytest.approx(0.1414, rel=0.15)


def test_scale_errors_are_the_seeds_and_last():
    noise = OdometryNoise(scale_error=0.02, slip=0.0, ticks_per_turn=1 << 20)
    first = roll(odometry_of(noise, 3), 50.0, 50.0)
    assert roll(odometry_of(noise, 3), 50.0, 50.0) == first
    assert roll(odometry_of(noise, 4), 50.0, 50.0) != first
    ends = [roll(odometry_of(noise, s), 50.0, 50.0, 20).pose.heading for s in range(200)]
    # (right - left) scale, 5 m over 0.4 m: sqrt(2) * 0.02 * 5 / 0.4 = 0.354 rad
    assert np.std(ends) == pytest.approx(0.354, rel=0.15)
