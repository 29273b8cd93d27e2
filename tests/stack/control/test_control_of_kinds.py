"""Cars and omnidirectional robots: every controller drives them as they can move."""

from math import cos, hypot, pi, sin

import numpy as np
import pytest

from stack.components import ControlState
from stack.control.path_follower import STEERED_END, facing_backward
from stack.errors import NavigationError
from stack.geometry.path_progress import PathProgress, split_at_cusps
from stack.types import STANDSTILL, FailureCode, Path, Pose2D, TaskStatus
from tests.stack.control.courses import controller, toy_drive
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import (
    ToyCostmap,
    ToyPlanner,
    ToyWorld,
    heading_error,
    moving,
    room,
)

CONTROLLERS = ("pure_pursuit", "dwb", "graceful", "mppi")
SMALLER = {"mppi": {"batch": 500}}
RADIUS = 0.5
"""Turning radius of the toy car, metres."""

THREE_POINT_TURN = [
    (Pose2D(4.0, 3.0, 0.0), Pose2D(2.0, 3.0, pi)),
    (Pose2D(2.0, 2.0, pi / 2), Pose2D(6.5, 1.0, pi)),
    (Pose2D(6.0, 4.5, -2.0), Pose2D(1.0, 1.0, -pi / 2)),
]


def line(start: Pose2D, length: float, *, spacing=0.05):
    """(n, 3) poses straight on from a pose; backward where the length is negative."""
    way = np.sign(length) * np.arange(0.0, abs(length) + 1e-9, spacing)
    return np.column_stack([
        start.x + way * np.cos(start.heading), start.y + way * np.sin(start.heading),
        np.full(way.size, start.heading),
    ])  # fmt: skip


def there_and_back(forward=1.5, backward=1.0):
    """A path along x that reverses at its far end."""
    return Path(
        np.vstack([line(Pose2D(1, 3), forward), line(Pose2D(1 + forward, 3), -backward)[1:]])
    )


def driven(name, world, path, seconds=20.0, **parameters):
    """Commands and poses of a drive along a path; until it stands at the end."""
    driver = controller(name, world, **{**SMALLER.get(name, {}), **parameters})
    costs, trace, still = ToyCostmap(world), [], 0
    driver.set_path(path)
    while world.time < seconds and still < 20:
        twist = driver.command(ControlState(world.time, world.pose, world.twist, costs.grid))
        still = still + 1 if twist == STANDSTILL else 0
        trace.append((twist, world.pose))
        world.drive(twist)
    return trace


def arc_end(radius, side, angle):
    """Pose after an arc from the origin; side is 1 to the left and -1 to the right."""
    return Pose2D(radius * sin(angle), side * radius * (1.0 - cos(angle)), side * angle)


@pytest.mark.parametrize("name", CONTROLLERS)
@pytest.mark.parametrize(("start", "goal"), THREE_POINT_TURN)
def test_a_car_reaches_goals_on_arcs_that_it_steers(name, start, goal):
    toy = toy_drive(name, room(8, 6), start, kind="ackermann", **SMALLER.get(name, {}))
    task = toy.navigator.base.navigate_to(goal)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    toy.navigator.close()
    assert toy.world.pose.distance_to(goal) < 0.15
    assert heading_error(toy.world.pose, goal) < 0.15
    assert toy.world.nearest > 0.0
    for twist in toy.commands:
        assert abs(twist.angular) <= abs(twist.linear) / RADIUS + 1e-9
        assert twist.lateral == 0.0


def test_a_car_at_its_goal_is_not_said_to_turn():
    toy = toy_drive("pure_pursuit", room(8, 6), Pose2D(1, 3), kind="ackermann")
    task, said = toy.navigator.base.navigate_to(Pose2D(3.0, 3.0)), set()
    while task.running:
        toy.step()
        said.add(task.feedback)
    toy.navigator.close()
    assert "stopping at the goal" in said
    assert "turning to the goal's heading" not in said


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_car_reverses_where_its_path_does(name):
    world = ToyWorld(room(8, 6), moving("ackermann"), Pose2D(1.0, 3.0))
    trace = driven(name, world, there_and_back())
    assert world.pose.distance_to(Pose2D(1.5, 3.0)) < 0.08
    assert max(pose.x for _, pose in trace) == pytest.approx(2.5, abs=STEERED_END + 0.03)
    backward = [twist.linear for twist, _ in trace if twist.linear < 0.0]
    assert min(backward) == pytest.approx(-world.robot.limits.reverse_speed, abs=0.02)
    signs = np.sign([twist.linear for twist, _ in trace if abs(twist.linear) > 0.02])
    assert np.count_nonzero(np.diff(signs)) == 1  # forward, then backward, and no more


def test_a_car_keeps_to_a_path_of_opposite_bends():
    """Without the path's own curvature it cut them by 0.16 m, more than a planner leaves free."""
    bends, pose = [], Pose2D(1.0, 3.0)
    for turn in (1.0, -1.0, 1.0, -1.0):  # 80 degrees each, with a radius of 0.7 m
        steps = [pose.compose(arc_end(0.7, turn, angle)) for angle in np.linspace(0.0, 1.4, 29)]
        bends += [[step.x, step.y, step.heading] for step in steps]
        pose = steps[-1]
    path = Path(np.array(bends))
    world = ToyWorld(room(9, 7), moving("ackermann"), Pose2D(1.0, 3.0))
    trace = driven("pure_pursuit", world, path)
    driven_at = np.array([(pose.x, pose.y) for _, pose in trace])
    away = np.hypot(*(driven_at[:, None] - path.points[None, :, :2]).transpose(2, 0, 1))
    assert away.min(axis=1).max() < 0.06
    assert world.pose.distance_to(path.goal) < 0.03
    assert heading_error(world.pose, path.goal) < 0.07


def test_a_path_is_cut_at_its_cusps():
    legs = split_at_cusps(there_and_back())
    assert [leg.backward for leg in legs] == [False, True]
    assert [round(leg.path.length, 6) for leg in legs] == [1.5, 1.0]
    assert legs[1].path.points[0] == pytest.approx([2.5, 3.0, 0.0])
    points = polyline((0, 0), (1, 0)).points.copy()
    points[0, 2] = points[-1, 2] = pi  # where the robot looks, and where it is to look at the goal
    assert [leg.backward for leg in split_at_cusps(Path(points))] == [False]
    assert split_at_cusps(Path(np.zeros((2, 3))))[0].path.length == 0.0


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_car_beside_its_goals_heading_says_so_instead_of_hanging(name):
    """Its planner leads to the goal's place, but not to its heading."""
    toy = toy_drive(name, room(8, 6), Pose2D(1, 3), kind="ackermann", **SMALLER.get(name, {}))
    toy.navigator.tools.planner_worker.planner = ToyPlanner()
    task = toy.navigator.base.navigate_to(Pose2D(4.0, 3.0, pi / 2))
    assert toy.finish(task) is TaskStatus.FAILED
    toy.navigator.close()
    assert task.failure.code == FailureCode.NO_PROGRESS
    assert "deg off its heading, and this robot cannot turn in place" in task.failure.sentence
    assert toy.world.time < 20.0


def test_a_given_path_that_ends_with_another_heading_fails_where_it_ends():
    toy = toy_drive("pure_pursuit", room(8, 6), Pose2D(1, 3), kind="ackermann")
    path = polyline((1, 3), (3, 3))
    path.points[-1, 2] = pi / 2
    task = toy.navigator.base.follow_path(path)
    toy.finish(task)
    toy.navigator.close()
    assert task.failure.code == FailureCode.NO_PROGRESS
    assert toy.world.pose.distance_to(path.goal) < 0.05


def test_progress_on_a_path_that_folds_back_is_made_in_order():
    path = there_and_back(1.5, 1.2)
    progress = PathProgress(path)
    for x in np.arange(1.0, 2.41, 0.05):
        progress.advance(Pose2D(float(x), 3.01))
    assert progress.travelled == pytest.approx(1.4, abs=0.01)
    assert not progress.segment.is_last and not progress.segment.backward
    progress.begin_next(Pose2D(2.47, 3.01))
    assert progress.segment.is_last and progress.segment.backward
    for x in np.arange(2.4, 1.29, -0.05):
        progress.advance(Pose2D(float(x), 3.01))
    assert progress.remaining == pytest.approx(0.0, abs=0.06)


def test_a_backward_segment_needs_a_robot_that_reverses():
    world = ToyWorld(room(8, 6), moving("ackermann", reverse_speed=0.0), Pose2D(1.0, 3.0))
    with pytest.raises(NavigationError) as caught:
        driven("pure_pursuit", world, there_and_back())
    assert caught.value.failure.code == FailureCode.NO_VALID_PATH
    assert "reverse_speed is 0" in caught.value.failure.sentence


def test_a_robot_seen_from_behind_has_its_rear_ahead():
    about = facing_backward(moving("ackermann", linear_speed=0.8, reverse_speed=0.3))
    assert about.limits.linear_speed == 0.3
    assert about.turning_radius == pytest.approx(RADIUS)


@pytest.mark.parametrize("name", ("pure_pursuit", "dwb", "mppi"))
def test_an_omnidirectional_robot_goes_sideways_to_a_place_beside_it(name):
    world = ToyWorld(room(8, 6), moving("omni"), Pose2D(2.0, 2.0, 0.0))
    parameters = {} if name == "pure_pursuit" else {"rotate_to_heading": False}
    path = polyline((2, 2), (2, 3))
    path.points[-1, 2] = 0.0
    trace = driven(name, world, path, **parameters)
    assert world.pose.distance_to(Pose2D(2.0, 3.0)) < 0.05
    assert heading_error(world.pose, Pose2D(2.0, 3.0, 0.0)) < 0.05
    assert max(twist.lateral for twist, _ in trace) > 0.1
    for twist, _ in trace:
        assert abs(twist.lateral) <= world.robot.limits.lateral_speed + 1e-6


@pytest.mark.parametrize("name", CONTROLLERS)
def test_an_omnidirectional_robot_reaches_goals(name):
    goal = Pose2D(6.5, 4.5, -pi / 2)
    toy = toy_drive(name, room(8, 6), Pose2D(1, 1, pi), kind="omni", **SMALLER.get(name, {}))
    task = toy.navigator.base.navigate_to(goal)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    toy.navigator.close()
    assert toy.world.pose.distance_to(goal) < 0.05
    assert heading_error(toy.world.pose, goal) < 0.0524


@pytest.mark.parametrize(("choice", "expected"), [("path", pi / 2), ("goal", 0.0)])
def test_pure_pursuit_faces_along_the_path_or_as_at_the_goal(choice, expected):
    world = ToyWorld(room(8, 8), moving("omni"), Pose2D(2.0, 1.0, 0.0))
    path = polyline((2, 1), (2, 6))
    path.points[-1, 2] = 0.0
    trace = driven("pure_pursuit", world, path, omni_heading=choice)
    half_way = min((pose for _, pose in trace), key=lambda pose: abs(pose.y - 3.5))
    assert heading_error(half_way, Pose2D(0, 0, expected)) < 0.05
    assert world.pose.distance_to(Pose2D(2.0, 6.0)) < 0.03
    assert max(hypot(twist.linear, twist.lateral) for twist, _ in trace) <= 0.8 + 1e-6


def test_a_short_first_leg_is_not_driven_at_the_speed_of_an_earlier_path():
    world = ToyWorld(room(8, 6), moving("ackermann"), Pose2D(2.0, 3.0, 0.0))
    driver, costs = controller("pure_pursuit", world), ToyCostmap(world)
    driver.set_path(Path(line(Pose2D(2.0, 3.0), 4.0)))
    while world.twist.linear < 0.5:
        world.drive(driver.command(ControlState(world.time, world.pose, world.twist, costs.grid)))
    here, still = Pose2D(5.0, 3.0), STANDSTILL  # long after that one was cancelled
    short = line(here, 0.8 * STEERED_END, spacing=0.4 * STEERED_END)
    driver.set_path(Path(np.vstack([short, line(here, -1.0)[1:]])))
    speeds = [
        driver.command(ControlState(60.0 + 0.05 * n, here, still, costs.grid)).linear
        for n in range(3)
    ]
    assert speeds[0] <= 0.15 and speeds[1] <= 0.075  # two steps of braking, instead of 0.5 m/s
