"""Wheels and gyro: both odometries against closed-form arcs and a drive with a biased gyro."""

from dataclasses import replace
from math import degrees, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import OdometryFusion
from stack.drivetrain.description import ImuDescription
from stack.localisation.fusion.ekf import EkfOdometry
from stack.localisation.fusion.wheels_gyro import WheelGyroOdometry
from stack.types import Imu, Odometry, Pose2D, Twist, wrap_angle
from tests.observed import observed
from tests.stack.sim.sim_rover import ROVER

EKF, WHEELS_GYRO = EkfOdometry, WheelGyroOdometry
BOTH = pytest.mark.parametrize("kind", [EKF, WHEELS_GYRO], ids=["ekf", "wheels_gyro"])


def fusion_of(kind: type[OdometryFusion], **parameters: float) -> OdometryFusion:
    return kind(kind.Parameters(**parameters), ROVER)


def on_arc(twist: Twist, time: float) -> Pose2D:
    """Closed form of a constant forward speed and turning rate from the origin."""
    turned = twist.angular * time
    if abs(turned) < 1e-9:
        return Pose2D(twist.linear * time, 0.0, turned)
    radius = twist.linear / twist.angular
    return Pose2D(radius * sin(turned), radius * (1.0 - np.cos(turned)), wrap_angle(turned))


def gyro(begin: float, end: float, rate: float, bias: float = 0.0, speed: float = 0.0) -> Imu:
    """Five samples on an arc: yaw rate with bias, centripetal acceleration, gravity."""
    stamps = np.linspace(begin, end, 6)[1:]
    angular = np.zeros((5, 3))
    angular[:, 2] = rate + bias
    return Imu(stamps, angular, np.tile([0.0, speed * rate, 9.81], (5, 1)))


@BOTH
@settings(deadline=None, max_examples=40)
@given(
    st.floats(0.01, 1.0) | st.floats(-1.0, -0.01),
    st.floats(-2.0, 2.0),
    st.sampled_from([0.05, 0.1, 0.5]),
)
def test_a_constant_twist_is_integrated_exactly(kind, linear, angular, period):
    """The wheels turn by 10 % too much; the gyro is right; the arc's closed form must come out."""
    fusion = fusion_of(kind)
    true, wheels = Twist(linear, angular), Twist(linear, 1.1 * angular)
    for step in range(11):
        now = step * period
        imu = gyro(now - period, now, angular, speed=linear) if step else None
        fused = fusion.update(observed(now, Odometry(now, on_arc(wheels, now), wheels), imu=imu))
    expected = on_arc(true, 10 * period)
    assert fused.pose.distance_to(expected) < 1e-8
    assert abs(wrap_angle(fused.pose.heading - expected.heading)) < 1e-9
    assert fused.twist.angular == pytest.approx(angular, abs=1e-9)


@BOTH
@pytest.mark.parametrize(("settling_time", "bias"), [(0.25, 0.02), (1.0, 0.0)])
def test_the_bias_is_measured_after_the_settling_time(kind, settling_time, bias):
    fusion = fusion_of(kind, settling_time=settling_time)
    for step in range(13):  # two steps of motion, half a second at rest; the gyro reads 0.02 rad/s
        now, moves = 0.05 * step, step < 2
        imu = gyro(now - 0.05, now, 0.0, bias=0.02) if step else None
        twist = Twist(0.1) if moves else Twist()
        fusion.update(observed(now, Odometry(now, Pose2D(0.0, 0.0), twist), imu=imu))
    assert fusion.gyro_bias == pytest.approx(bias, rel=0.01)  # the EKF has a prior of 0 ± 0.02


@BOTH
@settings(deadline=None, max_examples=20)
@given(st.floats(-0.03, 0.03), st.sampled_from([0.01, 0.05, 0.1]), st.floats(0.1, 1.0))
def test_a_robot_that_may_drive_knows_the_bias(kind, bias, period, settling_time):
    """It stands while `is_ready` is false; then it drives for 10 s straight ahead.

    The EKF has a prior of 0 ± 0.02 rad/s against samples of 4 mrad/s / sqrt(5): it is off by less
    than 5 % of the bias, which is 1.5 mrad/s and 0.9 degrees in 10 s.
    """
    fusion = kind(
        kind.Parameters(settling_time=settling_time), replace(ROVER, imu=ImuDescription())
    )
    x, moves, stood, now = 0.0, False, 0.0, 0.0
    for step in range(round(11.0 / period)):
        now = step * period
        x += 0.5 * period if moves else 0.0
        imu = gyro(now - period, now, 0.0, bias=bias) if step else None
        twist = Twist(0.5 if moves else 0.0)
        fused = fusion.update(observed(now, Odometry(now, Pose2D(x, 0.0), twist), imu=imu))
        if not moves and fusion.is_ready:
            moves, stood = True, now
    assert stood == pytest.approx(settling_time, abs=period + 1e-9)
    assert abs(degrees(fused.pose.heading)) < 0.9


@BOTH
def test_a_robot_whose_gyro_is_missing_or_silent_may_drive_at_once(kind):
    for robot, ready in ((ROVER, 0), (replace(ROVER, imu=ImuDescription()), 1)):
        fusion, found = kind(kind.Parameters(), robot), []
        for step in range(3):
            now = 0.05 * step
            fusion.update(observed(now, Odometry(now, Pose2D(0.0, 0.0), Twist())))
            found.append(fusion.is_ready)
        assert found.index(True) == ready


@BOTH
def test_without_a_gyro_the_wheel_odometry_is_used(kind):
    fusion = fusion_of(kind)
    twist = Twist(0.5, 0.4)
    for step in range(21):
        now = 0.05 * step
        wheels = Odometry(now, on_arc(twist, now), twist)
        fused = fusion.update(observed(now, wheels))
    assert fused.pose.distance_to(on_arc(twist, 1.0)) < 1e-12
    assert fused.twist == twist


def drive(
    kind: type[OdometryFusion], bias: float, stand: float, seed: int = 3
) -> tuple[OdometryFusion, float]:
    """Stand, then drive a square for 40 s with 1 % wheel errors; heading error at the end."""
    generator = np.random.default_rng(seed)
    fusion, wheels, heading = fusion_of(kind), Pose2D(0.0, 0.0), 0.0
    for step in range(round((stand + 40.0) / 0.05) + 1):
        now = step * 0.05
        moving = now > stand
        rate = (pi / 4 if int(now) % 4 == 3 else 0.0) if moving else 0.0
        speed = 0.5 if moving else 0.0
        measured = Twist(speed, rate + 0.02 * speed)
        if step:
            heading += rate * 0.05
            wheels = wheels.compose(on_arc(measured, 0.05))
        imu = gyro(now - 0.05, now, rate, bias, speed) if step else None
        if imu is not None:
            imu.angular_velocity[:, 2] += generator.normal(0.0, 0.004, 5)
        fused = fusion.update(observed(now, Odometry(now, wheels, measured), imu=imu))
    return fusion, abs(wrap_angle(fused.pose.heading - heading))


@BOTH
def test_the_bias_is_calibrated_at_standstill(kind):
    """2 s at 100 Hz of 0.004 rad/s noise leave a bias error of 0.004/sqrt(175) = 0.3 mrad/s."""
    fusion, error = drive(kind, bias=0.02, stand=2.0)
    assert fusion.gyro_bias == pytest.approx(0.02, abs=1e-3)
    # 40 s of 0.3 mrad/s is 12 mrad; the switching samples of the trapezoid add a few more
    assert error < 0.05


@BOTH
def test_an_uncalibrated_bias_turns_the_heading(kind):
    """40 s of 0.02 rad/s: 0.8 rad. Guards the test above against a gyro that is ignored."""
    _, error = drive(kind, bias=0.02, stand=0.0)
    assert error == pytest.approx(0.8, abs=0.1)


@BOTH
def test_a_rotation_by_hand_does_not_change_the_bias(kind):
    fusion, still = fusion_of(kind), Odometry(0.0, Pose2D(0.0, 0.0), Twist())
    for step in range(61):
        now = 0.05 * step
        rate = 0.5 if step > 20 else 0.0
        imu = gyro(now - 0.05, now, rate) if step else None
        fused = fusion.update(observed(now, Odometry(now, still.pose, Twist()), imu=imu))
    assert fusion.gyro_bias == 0.0
    assert fused.pose.heading == pytest.approx(0.5 * 2.0, abs=0.02)


@BOTH
@pytest.mark.parametrize(
    ("rate", "turned"), [(0.07, 0.07 * 2.0), (-0.07, -0.07 * 2.0), (0.04, 0.0)]
)
def test_a_standing_robot_is_turned_by_hand_beyond_what_may_be_bias(kind, rate, turned):
    """3 s with standing wheels, the last 2 s at a rate; a bias is at most 0.05 rad/s."""
    fusion = fusion_of(kind)
    for step in range(61):
        now = 0.05 * step
        imu = gyro(now - 0.05, now, rate if step > 20 else 0.0)
        wheels = Odometry(now, Pose2D(0.0, 0.0), Twist())
        fused = fusion.update(observed(now, wheels, imu=imu))
    # half a sample of the trapezoid: 0.07 * 0.005
    assert fused.pose.heading == pytest.approx(turned, abs=0.001)
    assert (fusion.gyro_bias == 0.0) == bool(turned)


@BOTH
def test_a_standing_robot_does_not_creep(kind):
    generator = np.random.default_rng(0)
    fusion = fusion_of(kind)
    for step in range(400):
        now = 0.05 * step
        imu = gyro(now - 0.05, now, 0.0, 0.01)
        imu.angular_velocity[:, 2] += generator.normal(0.0, 0.004, 5)
        wheels = Odometry(now, Pose2D(1.0, 2.0, 3.0), Twist())
        fused = fusion.update(observed(now, wheels, imu=imu))
    # only rounding of the last bit remains
    assert fused.pose.distance_to(Pose2D(1.0, 2.0)) < 1e-9
    assert abs(fused.pose.heading - 3.0) < 1e-9


@BOTH
@pytest.mark.parametrize("rate", [7.0, 15.0, 30.0, 33.0, 90.0, 101.0, 240.0])
def test_the_turn_rate_does_not_depend_on_the_rate_of_the_gyro(kind, rate):
    """1 rad/s with any number of samples in a step of 50 ms, none at 7 Hz in most of them."""
    fusion, taken = fusion_of(kind), 0
    still = Twist(0.0, 1.0)
    for step in range(121):
        now = 0.05 * step
        due = int(now * rate + 1e-9)
        stamps = np.arange(taken + 1, due + 1) / rate
        taken = due
        angular = np.zeros((stamps.size, 3))
        angular[:, 2] = 1.0
        imu = Imu(stamps, angular, np.zeros((stamps.size, 3))) if stamps.size else None
        wheels = Odometry(now, Pose2D(0.0, 0.0, wrap_angle(now)), still)
        fused = fusion.update(observed(now, wheels, imu=imu))
        if step > 4:
            assert fused.twist.angular == pytest.approx(1.0, abs=1e-6)
            assert wrap_angle(fused.pose.heading - now) == pytest.approx(0.0, abs=1e-6)


@BOTH
def test_wheels_measure_the_rotation_when_the_gyro_falls_silent(kind):
    """0.1 s after the last sample; until then its rate is held."""
    fusion, twist = fusion_of(kind), Twist(0.0, 0.9)
    headings = []
    for step in range(41):
        now = 0.05 * step
        imu = gyro(now - 0.05, now, 1.0) if 0 < step <= 20 else None
        wheels = Odometry(now, Pose2D(0.0, 0.0, 0.9 * now), twist)
        headings.append(fusion.update(observed(now, wheels, imu=imu)).pose.heading)
    rates = np.diff(headings) / 0.05
    assert rates[1:22] == pytest.approx([1.0] * 21)
    assert rates[22:] == pytest.approx([0.9] * 18)
