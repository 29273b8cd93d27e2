"""The dynamic window and its critics on inputs small enough to be worked out by hand."""

from math import cos, pi, sin

import numpy as np
import pytest

from stack.control.dwb import critics
from stack.control.dwb.controller import drive, window
from stack.control.dwb.critics import Sampling, Speeds
from stack.control.dwb.parameters import DwbParameters
from stack.types import STANDSTILL, CostGrid, Pose2D, Twist
from tests.stack.navigation.toy_world import robot

P = DwbParameters()
PATH = np.column_stack([0.05 * np.arange(41), np.zeros(41)])
"""2 m along x."""


def sampling(poses, *, linear=0.5, angular=0.0, costs=None, near_goal=False):
    """One motion through given poses; the path goes on straight beyond its goal at x = 2."""
    onward = np.column_stack([0.05 * np.arange(81), np.zeros(81)])
    return Sampling(
        Speeds(*np.array([[linear], [angular], [0.0]])), np.array([poses], float), PATH, onward,
        0.05, costs or CostGrid(np.zeros((4, 4), np.uint8), 0.05), near_goal,
    )  # fmt: skip


def test_the_window_is_what_can_be_reached_in_the_simulated_time():
    p = DwbParameters(simulation_time=1.0, linear_samples=3, angular_samples=3)
    slow = robot(linear_acceleration=0.2, linear_deceleration=0.3, angular_acceleration=0.5)
    speeds = window(p, slow, Twist(0.4, 0.1), 0.8)
    linear, angular = speeds.linear, speeds.angular
    assert not speeds.lateral.any()
    assert (linear.min(), linear.max()) == (0.0, pytest.approx(0.6))  # 0.1 is lowest, 0 is added
    assert sorted(set(np.round(linear, 6))) == [0.0, 0.1, 0.35, 0.6]
    assert (angular.min(), angular.max()) == (pytest.approx(-0.4), pytest.approx(0.6))
    assert window(p, robot(), STANDSTILL, 0.25).linear.max() == pytest.approx(0.25)
    assert window(DwbParameters(), robot(), STANDSTILL, 0.8).linear.min() == pytest.approx(-0.1)


def test_motions_ramp_to_their_speeds_and_follow_arcs():
    p = DwbParameters(simulation_time=2.0, simulation_step=0.1)
    fast = robot(linear_acceleration=1.0, angular_acceleration=100.0)
    speeds = Speeds(*np.array([[0.5, 0.5], [0.0, 0.5], [0.0, 0.0]]))
    poses = drive(p, fast, Pose2D(1.0, 2.0, pi / 2), STANDSTILL, speeds)
    assert poses.shape == (2, 20, 3)
    # 0.1, 0.2, 0.3, 0.4 m/s, then 16 steps at 0.5: (1.0 + 8.0) × 0.1 s
    assert poses[0, -1] == pytest.approx([1.0, 2.9, pi / 2])
    cruising = drive(p, fast, Pose2D(0.0, 0.0), Twist(0.5, 0.5), speeds)[1, -1]
    assert cruising == pytest.approx([sin(1.0), 1.0 - cos(1.0), 1.0], rel=2e-3)  # radius 1 m


def test_path_and_goal_distance():
    there = sampling([(0.5, 0.3, 0.0)] * 8)
    assert critics.path_distance(there, P) == pytest.approx([0.3])
    assert critics.goal_distance(there, P) == pytest.approx([1.5])
    drifting = sampling([(0.5, 0.1, 0.0)] * 4 + [(0.5, 0.5, 0.0)] * 4)
    assert critics.path_distance(drifting, P) == pytest.approx([0.3])  # the mean of 0.1 and 0.5
    close = sampling([(1.9, 0.2, 0.0)] * 8, near_goal=True)
    assert critics.goal_distance(close, P) == pytest.approx([np.hypot(0.1, 0.2)])


def test_the_aligning_critics_look_at_a_point_before_the_robot():
    turned = sampling([(0.5, 0.0, pi / 2)])
    assert critics.path_align(turned, P) == pytest.approx([0.3])
    assert critics.goal_align(sampling([(0.5, 0.0, 0.0)]), P) == pytest.approx([4.0 - 0.8])
    ahead_of_goal = sampling([(1.9, 0.0, 0.0)])
    assert critics.path_align(ahead_of_goal, P) == pytest.approx([0.0])  # the path goes on


def test_the_obstacle_critic_takes_the_worst_cost_on_the_way():
    cells = np.zeros((2, 4), np.uint8)
    cells[0] = [0, 126, 63, 255]
    costs = CostGrid(cells, 1.0)
    way = [(0.5, 0.5, 0), (1.5, 0.5, 0), (2.5, 0.5, 0), (3.5, 0.5, 0), (9.5, 0.5, 0)]
    assert critics.obstacle(sampling(way, costs=costs), P) == pytest.approx([0.5])


@pytest.mark.parametrize(
    ("linear", "angular", "expected"),
    [(0.5, 1.0, 0.0), (-0.05, 0.0, 1.0), (0.0, 1.9, 1.0), (0.05, 0.95, 0.25), (0.0, 0.0, 0.0)],
)
def test_forward_is_preferred_to_backward_and_to_turning_on_the_spot(linear, angular, expected):
    motion = sampling([(0, 0, 0)], linear=linear, angular=angular)
    assert critics.prefer_forward(motion, P) == pytest.approx([expected])
    assert critics.twirling(motion, P) == pytest.approx([abs(angular)])


def test_the_sum_leaves_out_what_does_not_count_near_the_goal():
    p = DwbParameters(
        path_distance_weight=2.0, goal_distance_weight=1.0, path_align_weight=0.0,
        goal_align_weight=0.0, obstacle_weight=5.0,
    )  # fmt: skip
    cells = np.full((8, 60), 126, np.uint8)
    costs = CostGrid(cells, 0.05, (0.0, -0.1))
    far = sampling([(1.0, 0.1, 0.0)], costs=costs)
    assert critics.total_cost(far, p) == pytest.approx([2 * 0.1 + 1.0 + 5 * 0.5])
    near = sampling([(1.8, 0.0, 0.0)], costs=costs, near_goal=True)
    assert critics.total_cost(near, p) == pytest.approx([0.2])
