from dataclasses import replace
from math import atan, cos, pi, sin

import numpy as np
import pytest

from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.description import OdometryNoise
from stack.drivetrain.differential import Wheels
from stack.drivetrain.omnidirectional import OmniWheels
from stack.sim.sensors.odometry import Odometry
from stack.types import Pose2D
from tests.stack.sim.sim_rover import ROVER

WHEELS = Wheels(("l",), ("r",), radius=0.1, separation=0.4)
PERFECT = OdometryNoise(scale_error=0.0, slip=0.0, ticks_per_turn=1 << 20)


def odometry_of(noise, seed=1):
    return Odometry(replace(ROVER, wheels=WHEELS, odometry=noise), seed)


def roll(odometry, left, right, readings=200):
    """Turn the wheels to these angles in equal parts, 10 ms each."""
    for n in range(readings + 1):
        odometry.update(0.01 * n, (left * n / readings, right * n / readings))
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


def test_scale_errors_depend_on_the_seed_and_stay_constant():
    noise = OdometryNoise(scale_error=0.02, slip=0.0, ticks_per_turn=1 << 20)
    first = roll(odometry_of(noise, 3), 50.0, 50.0)
    assert roll(odometry_of(noise, 3), 50.0, 50.0) == first
    assert roll(odometry_of(noise, 4), 50.0, 50.0) != first
    ends = [roll(odometry_of(noise, s), 50.0, 50.0, 20).pose.heading for s in range(200)]
    # (right - left) scale, 5 m over 0.4 m: sqrt(2) * 0.02 * 5 / 0.4 = 0.354 rad
    assert np.std(ends) == pytest.approx(0.354, rel=0.15)


SQUARE = OmniWheels(
    ("a", "b", "c", "d"),
    tuple(Pose2D(0.2 * cos(a), 0.2 * sin(a), a + pi / 2) for a in (0.0, pi / 2, pi, -pi / 2)),
    radius=0.05,
)  # fmt: skip
CAR = SteeredWheels(("s", "t"), ("l", "r"), 0.1, 0.5, 0.4, pi / 6, 1.0)


def steady(wheels, speeds, noise=PERFECT, steering=(), seed=1, seconds=2.0):
    """Odometry of wheels that roll at steady speeds, rad/s."""
    odometry = Odometry(replace(ROVER, wheels=wheels, odometry=noise), seed)
    for n in range(round(100 * seconds) + 1):
        odometry.update(0.01 * n, [0.01 * n * speed for speed in speeds], steering)
    return odometry.reading


@pytest.mark.parametrize("twist", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.3, -0.2, 0.0)])
def test_perfect_omnidirectional_wheels_drive_straight_in_any_direction(twist):
    reading = steady(SQUARE, (SQUARE.jacobian @ twist / 0.05).tolist())
    assert (reading.pose.x, reading.pose.y) == pytest.approx((2 * twist[0], 2 * twist[1]), abs=1e-4)
    assert abs(reading.pose.heading) < 1e-4
    assert (reading.twist.linear, reading.twist.lateral) == pytest.approx(twist[:2], abs=1e-3)


def test_perfect_omnidirectional_wheels_follow_the_circle_sideways():
    # Left at pi / 4 m/s and turning at pi / 4 rad/s for 2 s: a quarter of the circle of 1 m about
    # the point behind it.
    reading = steady(SQUARE, (SQUARE.jacobian @ (0.0, pi / 4, pi / 4) / 0.05).tolist())
    pose = reading.pose
    assert (pose.x, pose.y, pose.heading) == pytest.approx((-1.0, 1.0, pi / 2), abs=1e-4)


def test_four_wheels_average_their_slip():
    noise = OdometryNoise(scale_error=0.0, slip=0.02, ticks_per_turn=1 << 20)
    speeds = (SQUARE.jacobian @ (0.4, 0.4, 0.0) / 0.05).tolist()
    ends = [steady(SQUARE, speeds, noise, seed=seed).pose.heading for seed in range(200)]
    # Each wheel rolls 0.8 m; the turn is the mean of four over 0.2 m: 0.02 sqrt(0.8) / 2 / 0.2.
    assert np.std(ends) == pytest.approx(0.0447, rel=0.15)


def test_a_perfect_car_follows_the_circle():
    # Rear axle at pi / 4 m/s on a circle of 1 m to the right; inside wheel and outside wheel.
    steering = -atan(0.5 / 1.2), -atan(0.5 / 0.8)
    reading = steady(CAR, (pi / 4 * 1.2 / 0.1, pi / 4 * 0.8 / 0.1), steering=steering)
    pose = reading.pose
    assert (pose.x, pose.y, pose.heading) == pytest.approx((1.0, -1.0, -pi / 2), abs=1e-4)
    assert reading.twist.angular == pytest.approx(-pi / 4, rel=1e-3)


def test_a_car_s_slip_turns_it():
    noise = OdometryNoise(scale_error=0.0, slip=0.02, ticks_per_turn=1 << 20)
    ends = [steady(CAR, (20.0, 20.0), noise, (0.0, 0.0), seed).pose.heading for seed in range(150)]
    # Two wheels over 4 m: deviation sqrt(2 * 4) * 0.02 / 0.4 = 0.141 rad, as on any axle.
    assert np.std(ends) == pytest.approx(0.1414, rel=0.15)
