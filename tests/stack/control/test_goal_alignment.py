"""What controllers share at both ends of a path, and the footprint they sweep along it."""

from dataclasses import replace
from math import inf, pi

import numpy as np
import pytest

from stack.components import ControlState, GoalTolerance, StopCriterion
from stack.control.goal_alignment import GoalAlignment, GoalAlignmentParameters
from stack.control.path_follower import Arrival
from stack.control.ramps import Ramp, stopping_speed
from stack.control.swept import SweptFootprint
from stack.geometry.path_segment import PathSegment
from stack.types import STANDSTILL, CostGrid, Pose2D, Twist
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import RECTANGLE, robot

EMPTY = CostGrid(np.zeros((120, 120), np.uint8), 0.05)


def at(pose, twist=STANDSTILL, costs=EMPTY):
    return ControlState(0.0, pose, twist, costs)


def ends(path, **parameters):
    made = GoalAlignment(
        replace(GoalAlignmentParameters(), **parameters), robot(), SweptFootprint(RECTANGLE), 0.05
    )
    made.set_segment(PathSegment(path))
    return made


def begun(made, state):
    made.segment.advance(state.pose)
    made.begin(state)
    return made


def test_the_speed_that_still_stops_in_time():
    """Driven for the delay, then braked: v t + v² / 2a is the way."""
    speed = stopping_speed(1.0, 0.75, 0.15)
    assert speed * 0.15 + speed**2 / 1.5 == pytest.approx(1.0)
    assert stopping_speed(-0.1, 0.75, 0.15) == 0.0


def test_commands_change_by_what_the_drive_can_do():
    ramp = Ramp(robot().drivetrain, 0.05, 0.1)
    assert ramp.forward(0.2, 0.8) == pytest.approx(0.25)
    assert ramp.forward(0.2, 0.0) == pytest.approx(0.125)
    assert ramp.forward(-0.2, -0.8) == pytest.approx(-0.25)  # backward: the same 1.0 m/s²
    assert ramp.forward(-0.2, 0.0) == pytest.approx(-0.125)  # and 1.5 m/s²
    assert ramp.turn(0.0, -3.0) == pytest.approx(-0.16)
    stopped = ramp.stopped(Twist(0.3, 0.6))
    assert (stopped.linear, stopped.angular) == (pytest.approx(0.225), pytest.approx(0.45))
    assert ramp.stopped(Twist(0.01, 0.6)).linear == 0.0
    # 0.2 s at 1.5 m/s² are all that a late robot explains
    assert ramp.rebased(Twist(0.8, 0.0), Twist(0.1, 0.0)).linear == pytest.approx(0.4)


@pytest.mark.parametrize(("heading", "turns"), [(0.9, False), (1.1, True), (-2.9, True)])
def test_a_path_far_off_is_turned_to_first(heading, turns):
    state = at(Pose2D(1, 1, -heading))
    twist = begun(ends(polyline((1, 1), (3, 1))), state).turned(state)
    assert (twist is not None) == turns
    if twist is not None:
        assert twist.angular * heading > 0.0
    assert (
        begun(ends(polyline((1, 1), (3, 1)), rotate_to_heading=False), state).turned(state) is None
    )


def test_a_robot_under_way_is_not_stopped_by_a_corner():
    state = at(Pose2D(1, 1, -1.2), Twist(0.5))
    assert begun(ends(polyline((1, 1), (3, 1))), state).turned(state) is None


def test_the_goal_is_kept_though_turning_shifts_the_robot():
    path = polyline((1, 1), (2, 1), heading=pi / 2)
    arrival, criterion = Arrival(), StopCriterion(0.03)
    for new_path, x, reached in [
        (path, 1.98, True),
        (None, 1.95, True),  # within twice the distance of 0.03 m
        (polyline((1.95, 1), (2, 1), heading=pi / 2), 1.95, True),  # the same goal again
        (polyline((1.95, 1), (2.5, 1)), 1.95, False),
    ]:
        if new_path is not None:
            arrival.set_path(new_path, GoalTolerance())
            segment = PathSegment(new_path)
        segment.advance(Pose2D(x, 1))
        assert arrival.reached(Pose2D(x, 1), segment, criterion) == reached


def test_measured_along_the_path_a_goal_is_reached_beside_it_and_once_for_all():
    path = polyline((1, 1), (2, 1))
    arrival, segment, criterion = Arrival(), PathSegment(path), StopCriterion(0.01, along_path=True)
    arrival.set_path(path, GoalTolerance())
    for pose, reached in [
        (Pose2D(1.9, 1.0), False), (Pose2D(1.995, 1.1), True), (Pose2D(1.8, 1.0), True),
    ]:  # fmt: skip
        segment.advance(pose)
        assert arrival.reached(pose, segment, criterion) == reached
    arrival.set_path(path, GoalTolerance())  # the next path
    assert not arrival.reached(Pose2D(1.8, 1.0), PathSegment(path), criterion)
    short = polyline((2, 1.05), (2, 1))
    arrival.set_path(short, GoalTolerance())  # 5 cm from its former end: only the heading is left
    assert arrival.reached(Pose2D(2, 1.05), PathSegment(short), criterion)


def test_the_end_of_a_segment_before_a_cusp_is_no_goal():
    path = polyline((1, 1), (2, 1))
    arrival, segment = Arrival(), PathSegment(path, is_last=False)
    arrival.set_path(path, GoalTolerance())
    assert not arrival.reached(Pose2D(2, 1), segment, StopCriterion(0.1))


def test_at_the_goal_the_robot_turns_to_its_heading():
    path = polyline((1, 1), (2, 1), heading=pi / 2)
    turn = begun(ends(path), at(Pose2D(1.98, 1))).finish(at(Pose2D(1.98, 1)))
    assert turn is not None
    assert turn.linear == 0.0 and turn.angular > 0.0


def test_a_robot_that_does_not_follow_its_commands_counts_as_held():
    made = ends(polyline((1, 1), (3, 1)))
    for step in range(20):
        state = at(Pose2D(1, 1))
        made.begin(state)
        assert made.held == (step >= 10)  # 0.5 s
        made.commanded(Twist(0.3))
    for _ in range(10):
        made.begin(at(Pose2D(1, 1), Twist(0.3)))
        made.commanded(Twist(0.3))
    assert not made.held


def with_wall(column):
    cells = np.zeros((120, 120), np.uint8)
    cells[:, column] = 254
    return CostGrid(cells, 0.05)


def test_poses_are_clear_up_to_the_first_contact():
    """The cells begin at x = 3; a body whose nose is 0.25 m ahead may come to 2.75 m."""
    poses = np.array([[(1.0 + 0.2 * k, 3.0, 0.0) for k in range(15)]] * 2)
    poses[1, :, 0] = 1.0
    clear = SweptFootprint(RECTANGLE).clear_poses(with_wall(60), Pose2D(1.0, 3.0), poses)
    assert list(clear) == [9, 15]  # 2.6 m is clear, 2.8 m is not


def test_a_turn_sweeps_the_corners():
    """The corners reach 0.32 m: beside a wall 0.3 m away they meet it on the way round."""
    swept, costs = SweptFootprint(RECTANGLE), with_wall(60)
    free, _ = swept.arc(costs, Pose2D(2.7, 3.0), Twist(0.0, 1.0), pi)
    assert 0.0 < free < pi / 2
    assert swept.arc(costs, Pose2D(2.6, 3.0), Twist(0.0, 1.0), pi)[0] == inf


@pytest.mark.parametrize(("lookahead", "turns"), [(0.4, False), (1.4, True)])
def test_the_lookahead_decides_which_part_of_the_path_is_turned_to(lookahead, turns):
    corner = polyline((1, 1), (1.5, 1), (1.5, 4))  # 1.4 m along: 1.06 rad to the left
    state = at(Pose2D(1, 1))
    assert (begun(ends(corner, rotate_lookahead=lookahead), state).turned(state) is None) != turns


@pytest.mark.parametrize(("until", "goes_on"), [(0.3, True), (0.6, False)])
def test_a_turn_ends_at_a_share_of_the_angle_that_starts_it(until, goes_on):
    made = ends(polyline((1, 1), (3, 1)), rotate_until=until)
    assert begun(made, at(Pose2D(1, 1, 1.1))).turned(at(Pose2D(1, 1, 1.1))) is not None
    assert (made.turned(at(Pose2D(1, 1, 0.5))) is not None) == goes_on
