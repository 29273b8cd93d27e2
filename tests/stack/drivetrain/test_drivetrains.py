"""What each kind of drive answers, and that its two kinematics are inverse to each other."""

from math import cos, hypot, pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.differential import Wheels
from stack.drivetrain.drivetrain import DriveState
from stack.drivetrain.limits import Limits
from stack.drivetrain.omnidirectional import OmniWheels
from stack.types import STANDSTILL, Pose2D, Twist

LIMITS = Limits(linear_acceleration=1.0, linear_deceleration=2.0, angular_acceleration=4.0)
MOUNTS = tuple(Pose2D(0.2 * cos(a), 0.2 * cos(a - pi / 2), a + pi / 2) for a in (0.0, 2.1, 4.2))
DIFFERENTIAL = Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(LIMITS)
OMNI = OmniWheels(("a", "b", "c"), MOUNTS, 0.05).drivetrain(LIMITS)
CAR = SteeredWheels(
    ("s", "t"), ("l", "r"), radius=0.1, wheelbase=0.5, track=0.4, steering_angle=pi / 6,
    steering_speed=1.0,
).drivetrain(LIMITS)  # fmt: skip
ALL = (DIFFERENTIAL, OMNI, CAR)

speeds = st.floats(-1.5, 1.5)


def answers(drivetrain):
    return (
        drivetrain.turns_in_place, drivetrain.can_move_sideways, drivetrain.aligns_in_place,
        drivetrain.velocity_axes, drivetrain.skids,
    )  # fmt: skip


def test_each_kind_answers_what_callers_ask():
    assert answers(DIFFERENTIAL) == (True, False, True, 2, False)
    assert answers(OMNI) == (True, True, False, 3, False)
    assert answers(CAR) == (False, False, False, 2, False)
    assert CAR.turning_radius == pytest.approx(0.5 * 3**0.5)  # 0.5 m / tan 30 deg


@given(speeds, speeds, speeds)
def test_wheels_move_the_base_as_commanded(linear, angular, lateral):
    for drivetrain in ALL:
        twist = drivetrain.feasible(Twist(linear, angular, lateral))
        state = drivetrain.limit_step(DriveState(twist), twist, 1.0)
        wheels = drivetrain.to_wheels(state)
        radius = 0.05 if drivetrain is OMNI else 0.1
        rolled = [speed * radius for speed in drivetrain.encoder_angles(wheels.speeds)]
        moved = drivetrain.from_wheels(rolled, [0.0] * len(rolled), wheels.steering)
        found = (moved.x, moved.heading, moved.y)
        assert found == pytest.approx((twist.linear, state.twist.angular, twist.lateral), abs=1e-9)
        if abs(linear) > 1e-3:
            assert state.twist.angular == pytest.approx(twist.angular, abs=1e-9)


@given(st.tuples(speeds, speeds, speeds), st.tuples(speeds, speeds, speeds))
def test_a_step_stays_within_the_acceleration_limits(last, wanted):
    for drivetrain in ALL:
        before, target = (drivetrain.feasible(Twist(*twist)) for twist in (last, wanted))
        after = drivetrain.limit_step(DriveState(before), target, 0.1).twist
        change = hypot(after.linear - before.linear, after.lateral - before.lateral)
        assert change <= 0.2 + 1e-9  # 2 m/s² for 0.1 s
        gained = hypot(after.linear, after.lateral) - hypot(before.linear, before.lateral)
        assert gained <= 0.1 + 1e-9  # 1 m/s² for 0.1 s
        if drivetrain.turns_in_place:
            assert abs(after.angular - before.angular) <= 0.4 + 1e-9


def test_an_omnidirectional_robot_reverses_along_a_line_through_zero():
    # 0.1 m/s to zero takes 0.05 s at 2 m/s²; the rest of 0.1 s gives 0.05 m/s the other way.
    state = OMNI.limit_step(DriveState(Twist(0.06, 0.0, 0.08)), Twist(-0.6, 0.0, -0.8), 0.1)
    assert (state.twist.linear, state.twist.lateral) == pytest.approx((-0.03, -0.04))


def test_a_car_at_standstill_keeps_its_steering():
    moving = CAR.state_at(Twist(0.5, 0.4), CAR.at_rest)
    assert moving.steering == pytest.approx(0.3805, abs=1e-4)  # atan(0.5 m * 0.4 / 0.5)
    stopped = CAR.state_at(STANDSTILL, moving)
    assert stopped == DriveState(STANDSTILL, moving.steering)
    # Straight ahead is 0.3805 rad away; one period of 0.1 s at 1 rad/s steers 0.1 rad of it.
    assert CAR.limit_step(stopped, Twist(0.5), 0.1).steering == pytest.approx(0.2805, abs=1e-4)
    assert CAR.limit_step(DriveState(), Twist(0.5, 0.4), 0.1).steering == moving.steering


def test_a_standing_car_steers_before_it_drives():
    """Otherwise it would begin each segment of a turn on the arc of the segment before."""
    wanted, driven = Twist(-0.5, 0.4), 0.0  # steered by -0.3805 rad
    state = CAR.limit_step(DriveState(STANDSTILL, 0.3805), wanted, 0.1)
    for _ in range(6):
        assert abs(state.twist.linear) <= 0.002
        driven += 0.1 * state.twist.linear
        state = CAR.limit_step(state, wanted, 0.1)
    assert abs(driven) < 0.002
    for _ in range(10):
        state = CAR.limit_step(state, wanted, 0.1)
    assert state.twist == Twist(-0.5, pytest.approx(0.4))


def test_a_car_that_moves_steers_while_it_drives():
    state = CAR.limit_step(DriveState(Twist(0.3), 0.0), Twist(0.5, 0.4), 0.1)
    assert state.twist.linear == pytest.approx(0.4)  # 1 m/s² for 0.1 s
    assert state.steering == pytest.approx(0.1)  # 1 rad/s for 0.1 s
