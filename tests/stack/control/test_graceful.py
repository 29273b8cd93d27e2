"""The smooth control law against its formula, and where it leads."""

from dataclasses import replace
from math import atan, pi, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.control.graceful import Graceful
from stack.types import Pose2D
from tests.stack.navigation.toy_world import ToyWorld, heading_error, robot, room


def law(**parameters):
    world = ToyWorld(room(4, 4), robot())
    return Graceful(replace(Graceful.Parameters(), **parameters), world.robot, world.period).law


def test_a_target_straight_ahead_is_driven_to_at_full_speed():
    assert law()(Pose2D(0, 0), Pose2D(1, 0), 0.6) == (pytest.approx(0.6), pytest.approx(0.0))


def test_curvature_and_speed_follow_the_formula():
    """Line of sight along x at 2 m: phi = 0.4, delta = -0.3 (Park and Kuipers 2011, eq. 14, 15)."""
    k_phi, k_delta, beta, power = 1.5, 3.0, 0.4, 2.0
    steer = law(k_phi=k_phi, k_delta=k_delta, beta=beta, slowing_power=power)
    linear, angular = steer(Pose2D(0, 0, -0.3), Pose2D(2, 0, 0.4), 0.5)
    bend = k_phi * 0.4
    kappa = -(k_delta * (-0.3 - atan(-bend)) + (1 + k_phi / (1 + bend**2)) * sin(-0.3)) / 2
    assert linear == pytest.approx(0.5 / (1 + beta * abs(kappa) ** power))
    assert angular / linear == pytest.approx(kappa)


@settings(deadline=None, max_examples=50)
@given(
    st.floats(-1.2, 1.2), st.floats(0.8, 2.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)
)  # fmt: skip
def test_the_law_leads_into_the_target_pose(heading, distance, bearing, turn):
    """The law is globally asymptotically stable (their theorem 1): the pose is met on a curve."""
    steer = law()
    pose = Pose2D(0.0, 0.0, bearing + heading)
    reach = Pose2D(0.0, 0.0, bearing).compose(Pose2D(distance, 0.0, turn))
    nearest = 10.0
    for _ in range(600):
        linear, angular = steer(pose, reach, 0.4)
        pose = pose.compose(Pose2D(linear * 0.02, 0.0, angular * 0.02))
        nearest = min(nearest, pose.distance_to(reach))
        if nearest < 0.03:
            break
    assert nearest < 0.03
    assert heading_error(pose, reach) < 0.35


def test_turning_is_limited_on_the_same_arc():
    steer = law(turn_speed=0.5)
    linear, angular = steer(Pose2D(0, 0, pi / 2), Pose2D(0.5, 0, 0), 0.6)
    free_linear, free_angular = law(turn_speed=100.0)(Pose2D(0, 0, pi / 2), Pose2D(0.5, 0, 0), 0.6)
    assert abs(angular) <= 0.5 + 1e-9
    assert angular / linear == pytest.approx(free_angular / free_linear)
