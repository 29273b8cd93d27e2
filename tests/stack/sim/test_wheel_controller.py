from math import atan, cos, pi, sin, tan

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.drivetrain.omnidirectional import OmniWheels
from stack.sim.wheel_controller import WheelController
from stack.types import Pose2D, Twist

WHEELS = Wheels(("l",), ("r",), radius=0.1, separation=0.4)
LIMITS = Limits(
    linear_speed=0.8, reverse_speed=0.3, angular_speed=1.8, linear_acceleration=1.0,
    linear_deceleration=2.0, angular_acceleration=4.0,
)  # fmt: skip


@pytest.fixture
def drive():
    return WheelController(WHEELS.drivetrain(LIMITS), 0.002)


def run(drive, twist, steps):
    speeds = []
    for _ in range(steps):
        drive.command(twist)
        drive.advance()
        speeds.append((drive.setpoint.twist.linear, drive.setpoint.twist.angular))
    return speeds


def test_ramps_take_speed_over_acceleration(drive):
    speeds = run(drive, Twist(0.5, 1.0), 300)
    assert [v for v, _ in speeds].index(0.5) + 1 == 250  # 0.5 / 1.0 / 0.002
    assert [w for _, w in speeds].index(1.0) + 1 == 125  # 1.0 / 4.0 / 0.002
    run_down = run(drive, Twist(), 300)
    assert [v for v, _ in run_down].index(0.0) + 1 == 125  # 0.5 / 2.0 / 0.002


def test_turning_back_stops_at_the_deceleration_first(drive):
    run(drive, Twist(0.2), 200)
    speeds = [v for v, _ in run(drive, Twist(-0.2), 300)]
    assert speeds[49] == pytest.approx(0.0, abs=1e-12)  # 0.2 / 2.0 / 0.002 = 50 steps
    assert speeds[99] == pytest.approx(-0.1)  # then 50 steps at 1.0
    assert speeds[-1] == -0.2


def test_commands_are_limited(drive):
    assert run(drive, Twist(9.0, -9.0), 2000)[-1] == (0.8, -1.8)
    assert run(drive, Twist(-9.0), 2000)[-1][0] == -0.3


def test_wheel_speeds_of_a_turn(drive):
    run(drive, Twist(0.5, 1.0), 500)
    # (v -+ w b / 2) / r = (0.5 -+ 0.2) / 0.1
    assert drive.wheels.speeds == pytest.approx((3.0, 7.0))


@pytest.mark.parametrize(
    ("speed", "begins", "takes"),
    [
        (0.3, 100, 50),  # 0.3 / 3 / 0.002 steps, and it stands after 150: 0.3 s
        (0.75, 75, 125),  # it would have to begin after 25; it does after half of the time
    ],
)
def test_without_commands_it_stands_after_the_dead_man_time(drive, speed, begins, takes):
    run(drive, Twist(speed), 500)
    changes = [drive.advance() for _ in range(400)]
    # The last command was obeyed in one step already.
    assert changes.index(True) == pytest.approx(begins - 1, abs=1)
    assert drive.setpoint.twist.linear == 0.0
    assert sum(changes) == pytest.approx(takes, abs=1)


def test_an_emergency_stop_is_a_stop_of_its_own(drive):
    run(drive, Twist(0.6, 1.0), 500)
    steps = 0
    while drive.setpoint.twist != Twist():
        drive.command(Twist(), emergency_stop=True)
        drive.advance()
        twist = drive.setpoint.twist
        assert twist.angular == pytest.approx(twist.linear / 0.6)  # on the circle that it drove
        steps += 1
    # The outer wheel rolls at 0.6 + 1.0 * 0.2 m/s and slows down at 3 m/s².
    assert steps == pytest.approx(0.8 / 3.0 / 0.002, abs=1)
    drive.command(Twist(0.6), emergency_stop=True)
    drive.advance()
    assert drive.setpoint.twist == Twist()
    drive.command(Twist(0.6))
    drive.advance()
    assert drive.setpoint.twist.linear == pytest.approx(0.002)  # 1 m/s², as ever


def test_at_constant_speed_nothing_changes(drive):
    run(drive, Twist(0.5), 500)
    assert not drive.advance()


STAR = OmniWheels(
    ("a", "b", "c"),
    tuple(
        Pose2D(0.2 * cos(a), 0.2 * sin(a), a + pi / 2) for a in (0.0, 2 * pi / 3, -2 * pi / 3)
    ),
    radius=0.05,
)  # fmt: skip
CAR = SteeredWheels(
    ("s", "t"), ("l", "r"), radius=0.1, wheelbase=0.5, track=0.4, steering_angle=pi / 6,
    steering_speed=1.0,
)  # fmt: skip


def test_omnidirectional_wheels_drive_along_their_headings():
    drive = WheelController(STAR.drivetrain(Limits(lateral_speed=0.5)), 0.002)
    run(drive, Twist(0.3, 0.5, -0.2), 500)
    # Wheel a, 0.2 m ahead, pushes to the left: (-0.2 + 0.2 * 0.5) / 0.05.
    assert drive.wheels.speeds[0] == pytest.approx(-2.0)
    # The three headings are 120 degrees apart: what is left of the sum is the turning.
    assert sum(drive.wheels.speeds) == pytest.approx(3 * 0.2 * 0.5 / 0.05)


def test_a_car_s_wheels_share_one_centre():
    drive = WheelController(CAR.drivetrain(LIMITS), 0.002)
    run(drive, Twist(0.5, 0.4), 1000)  # a radius of 1.25 m
    assert drive.setpoint.steering == pytest.approx(atan(0.5 / 1.25))
    assert drive.wheels.steering == pytest.approx((atan(0.5 / 1.05), atan(0.5 / 1.45)))
    assert drive.wheels.speeds == pytest.approx((0.4 * 1.05 / 0.1, 0.4 * 1.45 / 0.1))


@given(st.floats(-3, 3), st.floats(-9, 9), st.floats(-3, 3), st.floats(-9, 9))
@settings(deadline=None, max_examples=50)
def test_no_command_makes_a_car_turn_tighter_than_it_can(v, w, later_v, later_w):
    drive = WheelController(CAR.drivetrain(LIMITS), 0.02)
    for wanted in (Twist(v, w), Twist(later_v, later_w)):
        before = drive.setpoint.steering
        for _ in range(20):
            drive.command(wanted)
            drive.advance()
            assert abs(drive.setpoint.steering) <= pi / 6
            assert abs(drive.setpoint.steering - before) <= 1.0 * 0.02 + 1e-12
            assert (
                abs(drive.setpoint.twist.angular)
                <= abs(drive.setpoint.twist.linear) * tan(pi / 6) / 0.5 + 1e-12
            )
            before = drive.setpoint.steering


def test_steps_are_skipped_only_while_nothing_changes(drive):
    drive.command(Twist(0.1))
    assert not drive.skip(5)  # speeding up: 0.1 / 1.0 / 0.002 = 50 steps
    run(drive, Twist(0.1), 51)  # and one that changes nothing
    one_by_one = WheelController(WHEELS.drivetrain(LIMITS), 0.002)
    run(one_by_one, Twist(0.1), 51)
    skipped = 0
    while drive.skip(5):
        skipped += 5
        assert [one_by_one.advance() for _ in range(5)] == [False] * 5
    for _ in range(300 - skipped):  # past the dead-man time, 0.3 s after the last command
        assert drive.advance() == one_by_one.advance()
        assert drive.setpoint == one_by_one.setpoint
    assert drive.setpoint.twist == Twist()
    assert 0 < skipped < 300
