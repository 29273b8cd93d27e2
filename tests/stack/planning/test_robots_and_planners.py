"""Pose planners respect the robot's turning radius and reverse speed."""

from dataclasses import replace
from math import pi, tan
from pathlib import Path as FilePath

import numpy as np
import pytest

from missions.execution.prepare import RunOptions, prepare
from stack.components import choose
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.drivetrain.ackermann import SteeredWheels
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.errors import InputError
from stack.types import FREE, OCCUPIED, CostGrid, Footprint, OccupancyGrid, Pose2D
from tests.stack.planning.footprint_check import first_blocked
from tests.stack.planning.test_pose_planners import assert_drivable, directions_of

CAR_OUTLINE = Footprint(np.array([[0.5, -0.2], [0.5, 0.2], [-0.15, 0.2], [-0.15, -0.2]]))
CAR = RobotDescription(
    "car", CAR_OUTLINE, 0.4, FilePath("none.urdf"),
    SteeredWheels(("a", "b"), ("c", "d"), 0.05, wheelbase=0.35, track=0.3, steering_angle=0.5,
                  steering_speed=2.0),
)  # fmt: skip
RADIUS = 0.35 / tan(0.5)
"""Of the circle of the rear axle's middle: 0.641 m."""
ROUND = RobotDescription(
    "round", Footprint.circle(0.22), 0.4, FilePath("none.urdf"), Wheels((), (), 0.05, 0.3)
)


def planner(name, robot, **values):
    choice = choose("planner", name, values)
    return choice.component(choice.parameters, robot)


def open_floor():
    return CostGrid(np.zeros((120, 120), dtype=np.uint8), 0.05)


def test_a_path_of_a_car_keeps_its_turning_radius():
    made = planner("hybrid_astar", CAR, smoother="none", non_straight_penalty=1.0, motion="dubins")
    # half a circle to the left: the goal is a diameter to the left of the start and faces back
    path = made.plan(open_floor(), Pose2D(3, 2, 0), Pose2D(3, 2 + 2 * RADIUS, pi))
    assert path.length == pytest.approx(pi * RADIUS, rel=0.01)


def test_a_radius_below_the_robots_is_an_error_with_both_numbers():
    with pytest.raises(InputError, match=r"turning_radius: 0\.5 m is below .* 0\.641 m"):
        planner("hybrid_astar", CAR, turning_radius=0.5)
    planner("hybrid_astar", CAR, turning_radius=0.7)
    planner("hybrid_astar", ROUND, turning_radius=0.1)  # turns in place: any radius is possible


def test_the_lattice_needs_a_robot_that_turns_in_place():
    with pytest.raises(InputError, match=r"turning radius of car is 0\.641 m; use hybrid_astar"):
        planner("lattice", CAR)


def test_a_mission_with_such_a_choice_is_rejected_before_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr(RobotDescription, "turning_radius", 0.9)
    file = tmp_path / "tight.yaml"
    file.write_text(
        "mission: tight\nformat: 1\nrobot: scout\nworld: small_room\n"
        "navigation:\n  planner: {use: hybrid_astar, turning_radius: 60 cm}\n"
        "run: {say: hello}\n"
    )
    with pytest.raises(InputError, match=r"tight.yaml:6:.*E111.* 0\.6 m is below .* 0\.9 m"):
        prepare(file, RunOptions())


@pytest.mark.parametrize("name", ["hybrid_astar", "lattice"])
def test_a_robot_without_reverse_is_never_sent_backward(name):
    forward_only = replace(ROUND, limits=Limits(reverse_speed=0.0))
    start, goal = Pose2D(3.0, 3.0, 0.0), Pose2D(2.5, 3.0, 0.0)  # half a metre behind
    back = planner(name, ROUND, reverse_penalty=1.0).plan(open_floor(), start, goal)
    assert np.any(directions_of(back.points)[0] == -1)
    made = planner(name, forward_only, reverse_penalty=1.0)
    path = made.plan(open_floor(), start, goal)
    if name == "hybrid_astar":
        assert np.all(directions_of(path.points)[0] == 1) and path.length > 2.0  # all the way round
    method = made._method(0.05)
    assert not [kind for kind in method.moves.kinds if kind in (2, 3, 4)]
    assert not any(getattr(shortcut, "both_ways", False) for shortcut in method.shortcuts)


def test_a_car_gets_into_a_garage_and_out_again_touching_nothing():
    cells = np.full((100, 100), FREE, dtype=np.int8)
    cells[:2] = cells[-2:] = OCCUPIED
    cells[:40, 30:32] = cells[:40, 52:54] = OCCUPIED  # 1 m wide, 2 m deep
    grid = Costmap(CostmapParameters(), CAR_OUTLINE, OccupancyGrid(cells, 0.05)).grid
    inside, outside = Pose2D(2.1, 0.9, pi / 2), Pose2D(3.5, 3.5, pi)
    made = planner("hybrid_astar", CAR, tolerance=0.0)
    for start, goal in ((outside, inside), (inside, outside)):
        points = made.plan(grid, start, goal).points
        assert points[-1] == pytest.approx([goal.x, goal.y, goal.heading])
        assert first_blocked(grid, points, CAR_OUTLINE) is None
        assert_drivable(points, RADIUS)
