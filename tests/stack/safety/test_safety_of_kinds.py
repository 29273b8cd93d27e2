"""What safety lets through is what a car and an omnidirectional robot can drive, and no more."""

from dataclasses import replace
from math import atan, hypot, inf, pi

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stack.drivetrain.kinematics import share_within_limits, speed_towards
from stack.safety.parameters import SafetyParameters
from stack.safety.smoother import VelocitySmoother, within_limits
from stack.types import STANDSTILL, ObstaclePoints, Pose2D, Twist
from tests.stack.navigation.toy_world import ToyWorld, moving, room
from tests.stack.safety.obstacles import SafetyStage, standing

RADIUS, WHEELBASE, STEERING_SPEED = 0.5, 0.3, 4.0
"""Of the toy car: metres, metres, rad/s."""

speeds = st.floats(-1.5, 1.5)


def smoothed(robot, wishes):
    """What the smoother makes of wishes, one a period of 0.05 s."""
    smoother, given_ = VelocitySmoother(robot, 0.05), []
    for wish in wishes:
        given_.append(smoother.towards(wish))
        smoother.continue_from(given_[-1])
    return given_


@given(speeds, speeds, speeds, st.floats(0.1, 2.0))
def test_limits_hold_for_every_kind(linear, angular, lateral, top):
    for kind in ("differential", "omni", "ackermann"):
        robot = moving(kind)
        twist = within_limits(Twist(linear, angular, lateral), robot, top)
        limits = robot.limits
        assert -limits.reverse_speed - 1e-9 <= twist.linear <= limits.linear_speed + 1e-9
        assert hypot(twist.linear, twist.lateral) <= top + 1e-9
        assert abs(twist.lateral) <= limits.lateral_speed + 1e-9
        assert abs(twist.angular) <= limits.angular_speed + 1e-9
        if kind == "ackermann":
            assert abs(twist.angular) * RADIUS <= abs(twist.linear) + 1e-9


def test_a_limited_twist_keeps_its_direction_and_its_arc():
    omni = within_limits(Twist(0.6, 0.4, 0.8), moving("omni"), 0.5)
    assert hypot(omni.linear, omni.lateral) == pytest.approx(0.5)  # speed 1.0, halved
    assert (omni.linear, omni.angular, omni.lateral) == pytest.approx((0.3, 0.2, 0.4))
    car = within_limits(Twist(0.8, 4.0), moving("ackermann"), 0.4)
    assert (car.linear, car.angular) == pytest.approx((0.4, 0.4 / RADIUS))
    assert share_within_limits(Twist(0.8, 0.0), moving("omni").limits) == 1.0


def test_a_drive_makes_of_a_twist_what_it_can():
    assert moving("differential").drivetrain.feasible(Twist(0.3, 1.0, 0.5)) == Twist(0.3, 1.0)
    assert moving("omni").drivetrain.feasible(Twist(0.3, 1.0, 0.5)) == Twist(0.3, 1.0, 0.5)
    assert moving("ackermann").drivetrain.feasible(Twist(0.3, -1.0, 0.5)) == Twist(0.3, -0.6)
    assert moving("ackermann").drivetrain.feasible(Twist(0.0, 1.0)) == STANDSTILL


def test_the_top_speed_of_an_omnidirectional_robot_depends_on_the_direction():
    limits = moving("omni", linear_speed=0.8, lateral_speed=0.4, reverse_speed=0.2).limits
    assert speed_towards(0.0, limits) == pytest.approx(0.8)
    assert speed_towards(pi / 2, limits) == pytest.approx(0.4)
    assert speed_towards(pi, limits) == pytest.approx(0.2)
    assert speed_towards(pi / 4, limits) == pytest.approx(0.4 * 2**0.5)


def test_an_omnidirectional_robot_speeds_up_and_brakes_along_a_straight_line():
    robot = moving("omni", linear_acceleration=1.0, linear_deceleration=2.0)
    rising = smoothed(robot, [Twist(0.3, 0.0, 0.4)] * 12)
    for twist in rising:
        assert twist.lateral * 0.3 == pytest.approx(twist.linear * 0.4)
    assert hypot(rising[0].linear, rising[0].lateral) == pytest.approx(0.05)
    assert rising[-1] == Twist(0.3, 0.0, 0.4)
    falling = smoothed(robot, [Twist(0.3, 0.0, 0.4)] * 10 + [STANDSTILL])[-1]
    assert (falling.linear, falling.lateral) == pytest.approx((0.24, 0.32))  # 0.5 less 0.1


def test_a_cars_wheels_steer_no_faster_than_they_can_and_stay_while_it_brakes():
    robot = moving("ackermann")
    robot = replace(robot, wheels=replace(robot.wheels, steering_speed=2.0))
    driven = smoothed(robot, [Twist(0.5, 1.0)] * 20 + [STANDSTILL] * 3)
    angles = [atan(WHEELBASE * twist.angular / twist.linear) for twist in driven]
    changes = [b - a for a, b in zip([0.0, *angles], angles, strict=False)]
    assert max(map(abs, changes)) == pytest.approx(2.0 * 0.05)
    assert angles[19] == pytest.approx(atan(WHEELBASE / 0.5))  # 0.5 m/s at 1 rad/s: 0.5 m
    assert angles[20:] == pytest.approx([angles[19]] * 3)
    assert driven[-1].linear < driven[-2].linear < 0.5


def test_a_dead_band_keeps_a_cars_arc():
    robot, parameters = moving("ackermann", lidar=False), SafetyParameters(dead_band=0.1)
    safety = SafetyStage(robot, parameters, 0.05)
    for _ in range(8):
        twist = safety.limit(Twist(0.4, 0.4), standing(), ObstaclePoints())
        assert abs(twist.linear) >= 0.1
        assert abs(twist.angular) <= abs(twist.linear) + 1e-9  # radius 1 m or wider
    slow = SafetyStage(robot, parameters, 0.05)
    for _ in range(8):
        twist = slow.limit(Twist(0.05, 0.1), standing(), ObstaclePoints())
    assert twist == STANDSTILL


@settings(deadline=None, max_examples=20)
@given(
    st.sampled_from(["omni", "ackermann"]), st.floats(0.6, 3.4), st.floats(0.6, 3.4),
    st.floats(-pi, pi), st.lists(st.tuples(speeds, speeds, speeds), min_size=3, max_size=3),
    st.lists(
        st.tuples(st.floats(0.3, 3.7), st.floats(0.3, 3.7), st.floats(0.1, 0.4)), max_size=4
    ),
)  # fmt: skip
def test_no_command_causes_a_contact(kind, x, y, heading, wishes, circles):
    robot = moving(kind, linear_acceleration=2.0)
    world = ToyWorld(room(4, 4), robot, Pose2D(x, y, heading), circles, beams=720)
    assume(world.clearance() > 0.05)
    safety = SafetyStage(robot, SafetyParameters(), world.period)
    for wish in wishes:
        for _ in range(40):
            twist = safety.limit(
                Twist(*wish), world.odometry, world.obstacles, speed_limit=inf
            )  # fmt: skip
            if kind == "ackermann":
                assert abs(twist.angular) * RADIUS <= abs(twist.linear) + 1e-9
            world.drive(twist)
    assert world.nearest > 0.0
