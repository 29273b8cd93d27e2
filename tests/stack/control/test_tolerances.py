"""Goals are reached within the tolerance asked for, also where it is fine and the goal near."""

from dataclasses import replace
from math import hypot, pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import GoalTolerance, component
from stack.control.checkers import StoppedGoalChecker, StoppedGoalParameters
from stack.control.parameters import STOP_SHARE
from stack.types import Pose2D, TaskStatus, wrap_angle
from tests.stack.control.courses import toy_drive
from tests.stack.navigation.toy_world import heading_error, room

CONTROLLERS = ("pure_pursuit", "dwb", "graceful", "mppi")
SMALLER = {"mppi": {"batch": 300}}
START = Pose2D(3.0, 3.0, 0.3)


def driven(name, tolerance, offset, kind="differential"):
    """Drive to a goal beside the start; the drive, its task and the goal."""
    toy = toy_drive(name, room(6, 6), START, kind=kind, **SMALLER.get(name, {}))
    parameters = StoppedGoalParameters(tolerance.position, tolerance.heading)
    toy.navigator.tools.goal_checker = StoppedGoalChecker(parameters, toy.world.robot)
    x, y, turn = offset
    goal = Pose2D(START.x + x, START.y + y, wrap_angle(START.heading + turn))
    task = toy.navigator.base.navigate_to(goal)
    toy.finish(task)
    toy.navigator.close()
    return toy, task, goal


@given(
    position=st.floats(0.005, 0.5), heading=st.floats(radians(0.2), radians(30.0)),
    away=st.floats(0.0, 1.0), bearing=st.floats(-pi, pi), turn=st.floats(-pi, pi),
    name=st.sampled_from(("pure_pursuit", "graceful")),
)  # fmt: skip
@settings(deadline=None, max_examples=15)
def test_with_a_perfect_estimate_every_tolerance_is_met(
    position, heading, away, bearing, turn, name
):
    tolerance = GoalTolerance(position, heading)
    away *= away  # many goals close by
    offset = away * np.cos(bearing), away * np.sin(bearing), turn
    toy, task, goal = driven(name, tolerance, offset)
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    assert toy.world.pose.distance_to(goal) <= 2.0 * position  # doubled while the robot turns
    assert heading_error(toy.world.pose, goal) <= heading + 1e-9


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize(
    ("position", "heading", "offset"),
    [
        (0.01, 0.15, (0.04, 0.0, 0.0)),  # once within the constant of 6 cm
        (0.01, 0.01, (-0.03, 0.02, -1.0)),
        (0.15, radians(1.0), (0.0, 0.0, 0.5)),  # once above the constant of 1.15 degrees
        (0.005, radians(0.2), (0.6, 0.2, 1.0)),
    ],
)
def test_every_controller_meets_a_fine_tolerance(name, position, heading, offset):
    toy, task, goal = driven(name, GoalTolerance(position, heading), offset)
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    assert toy.world.pose.distance_to(goal) <= position
    assert heading_error(toy.world.pose, goal) <= heading + 1e-9


def test_an_omnidirectional_robot_meets_a_fine_tolerance():
    toy, task, goal = driven("pure_pursuit", GoalTolerance(0.01, 0.01), (0.03, 0.03, 0.5), "omni")
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    assert toy.world.pose.distance_to(goal) <= 0.01


def test_a_robot_within_the_tolerance_does_not_move():
    toy, task, _ = driven("pure_pursuit", GoalTolerance(0.05, 0.15), (0.04, 0.0, 0.0))
    assert task.status is TaskStatus.SUCCEEDED
    assert toy.world.pose.distance_to(START) == 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_parameters_stop_the_robot_inside_the_tolerance_and_never_less_exactly(name):
    parameters = component("controller", name).Parameters()
    assert parameters.within(GoalTolerance()) == parameters
    assert parameters.within(GoalTolerance(0.15, 0.15)) == parameters  # the defaults
    fine = parameters.within(GoalTolerance(0.004, 0.002))
    assert (fine.stop_distance, fine.turn_precision) == (STOP_SHARE * 0.004, STOP_SHARE * 0.002)
    assert replace(fine, stop_distance=parameters.stop_distance,
                   turn_precision=parameters.turn_precision) == parameters  # fmt: skip


def test_a_lateral_error_is_corrected_by_a_short_turn_and_drive():
    """Straight ahead of it a goal 2 cm aside cannot be met; the robot turns for it."""
    toy, task, goal = driven("graceful", GoalTolerance(0.005, 0.02), (0.0, 0.02, 0.0))
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    speeds = [hypot(twist.linear, twist.lateral) for twist in toy.commands]
    assert max(speeds) < 0.3
    assert toy.world.pose.distance_to(goal) <= 0.005
