"""Every controller drives to goals and through narrow places without contact, in a toy world."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import ControlState
from stack.errors import NavigationError
from stack.streams import stream
from stack.types import STANDSTILL, FailureCode, Pose2D, TaskStatus
from tests.stack.control.courses import controller, course, toy_drive
from tests.stack.control.test_pure_pursuit import polyline
from tests.stack.navigation.toy_world import ToyCostmap, ToyWorld, heading_error, robot, room

DIVIDED = [*room(8, 6), (4, 0, 4, 2.2), (4, 3.8, 4, 6)]
"""Two rooms, joined by a gap 1.6 m wide at (4, 3)."""
SAMPLING = ("mppi", "dwb", "graceful")
NARROW = [
    *(("mppi", name, shape) for name in ("s-bend", "corner", "door") for shape in ("round", "box")),
    *(("graceful", name, "round") for name in ("s-bend", "corner", "door")),
    ("graceful", "s-bend", "box"), ("graceful", "corner", "box"),
    *(("dwb", name, "round") for name in ("s-bend", "corner", "door")),
]  # fmt: skip
"""What each controller masters. Arcs of constant speeds (dwb) round no corner with a body that has
to be aligned, and the smooth control law does not line up a box with a door."""


def random_pose(random, world):
    """A pose in free space, 20 cm and more from everything."""
    while True:
        x, y, heading = (float(v) for v in random.uniform((0.3, 0.3, -pi), (7.7, 5.7, pi)))
        world.pose = Pose2D(x, y, heading)
        if world.clearance() > 0.2:
            return world.pose


@pytest.mark.parametrize("name", SAMPLING)
@pytest.mark.parametrize("batch", range(2))
def test_goals_are_reached_from_anywhere_without_contact(name, batch):
    random = stream(batch, "starts")
    for _ in range(6):
        world = ToyWorld(DIVIDED, robot())
        goal, start = random_pose(random, world), random_pose(random, world)
        toy = toy_drive(name, DIVIDED, start)
        task = toy.navigator.base.navigate_to(goal)
        assert toy.finish(task) is TaskStatus.SUCCEEDED, (start, goal, task.failure)
        assert toy.world.pose.distance_to(goal) < 0.05
        assert heading_error(toy.world.pose, goal) < 0.0524  # 3 degrees
        assert toy.world.nearest > 0.0
        toy.navigator.close()


@pytest.mark.parametrize(("name", "place", "shape"), NARROW)
def test_narrow_places_are_passed_without_contact(name, place, shape):
    where = course(place, shape)
    toy = toy_drive(name, where.walls, where.start, shape)
    task = toy.navigator.base.navigate_to(where.goal)
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    assert toy.world.nearest > 0.0
    assert toy.world.pose.distance_to(where.goal) < 0.05
    toy.navigator.close()


def commands(name, *, steps=60, limits=None, corners=((1, 1), (3, 1), (3, 3)), **parameters):
    """(n, 3) commands and poses of a drive round a corner in an empty room."""
    world = ToyWorld(room(8, 8), robot(**(limits or {})), Pose2D(*corners[0], 0.3))
    driver, costs = controller(name, world, **parameters), ToyCostmap(world)
    driver.set_path(polyline(*corners))
    trace = []
    for _ in range(steps):
        twist = driver.command(ControlState(world.time, world.pose, world.twist, costs.grid))
        world.drive(twist)
        trace.append((twist.linear, twist.angular, twist.lateral, world.pose.x, world.pose.y))
    return np.array(trace)


@pytest.mark.parametrize("name", SAMPLING)
def test_two_runs_are_equal_to_the_last_bit(name):
    assert np.array_equal(commands(name), commands(name))


@pytest.mark.parametrize("name", SAMPLING)
@settings(deadline=None, max_examples=8)
@given(
    speed=st.floats(0.2, 2.0), up=st.floats(0.3, 5.0), down=st.floats(0.5, 5.0),
    turn=st.floats(0.5, 4.0), turn_up=st.floats(1.0, 10.0),
)  # fmt: skip
def test_commands_stay_within_the_robots_limits(name, speed, up, down, turn, turn_up):
    limits = {
        "linear_speed": speed, "linear_acceleration": up, "linear_deceleration": down,
        "angular_speed": turn, "angular_acceleration": turn_up,
    }  # fmt: skip
    smaller = {"batch": 200} if name == "mppi" else {}
    trace = commands(name, limits=limits, **smaller)
    assert trace[:, 0].max() <= speed + 1e-6
    assert trace[:, 0].min() >= -0.3 - 1e-6  # the robot's reverse speed
    assert abs(trace[:, 1]).max() <= turn + 1e-6
    forward = np.diff(trace[:, 0])[(trace[1:, 0] > 0) & (trace[:-1, 0] >= 0)]
    assert forward.max(initial=0.0) <= up * 0.05 + 1e-6
    assert trace[-1, 3] > 1.1  # it drives


@pytest.mark.parametrize("name", SAMPLING)
def test_it_stands_before_an_obstacle_and_gives_up_when_patience_is_over(name):
    walls = [(0, 0, 6, 0), (0, 0.9, 6, 0.9), (0, 0, 0, 0.9), (6, 0, 6, 0.9)]
    world = ToyWorld(walls, robot(), Pose2D(0.6, 0.45), circles=[(3.0, 0.45, 0.2)])
    driver, costs = controller(name, world), ToyCostmap(world)
    driver.set_path(polyline((0.6, 0.45), (5.0, 0.45)))
    with pytest.raises(NavigationError) as caught:
        while world.time < 30.0:
            state = ControlState(world.time, world.pose, world.twist, costs.grid)
            world.drive(driver.command(state))
    assert caught.value.failure.code == FailureCode.COLLISION_AHEAD
    assert world.nearest > 0.0
    assert 1.5 < world.pose.x < 2.56  # the front is 0.25 m ahead of the base


@pytest.mark.parametrize("name", SAMPLING)
def test_a_path_behind_is_turned_to_on_the_spot(name):
    world = ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0, pi))
    driver, costs = controller(name, world), ToyCostmap(world)
    driver.set_path(polyline((3, 3), (5, 3)))
    for _ in range(50):
        state = ControlState(world.time, world.pose, world.twist, costs.grid)
        world.drive(driver.command(state))
        if abs(world.pose.heading) < 0.2:
            break
        assert abs(world.pose.x - 3.0) < 0.05
    assert abs(world.pose.heading) < 0.2


@pytest.mark.parametrize("name", SAMPLING)
def test_without_a_path_it_stands_and_has_no_plan(name):
    world = ToyWorld(room(6, 6), robot(), Pose2D(3.0, 3.0))
    driver = controller(name, world)
    state = ControlState(0.0, world.pose, world.twist, ToyCostmap(world).grid)
    assert driver.command(state) == STANDSTILL
    assert driver.local_plan is None
    driver.set_path(polyline((3, 3), (5, 3)))
    driver.command(state)
    plan = driver.local_plan
    assert plan is not None
    assert plan.points.shape[1] == 3
    assert 3.0 < plan.goal.x < 6.0


@pytest.mark.parametrize("name", SAMPLING)
def test_parameters_take_effect_between_two_steps(name):
    world = ToyWorld(room(9, 4), robot(), Pose2D(1.0, 2.0))
    driver, costs = controller(name, world), ToyCostmap(world)
    driver.set_path(polyline((1, 2), (8, 2)))
    for step in range(120):
        if step == 60:
            assert world.twist.linear > 0.6
            driver.configure(type(driver.parameters)(cruise_speed=0.3))
        state = ControlState(world.time, world.pose, world.twist, costs.grid)
        world.drive(driver.command(state))
    assert 0.2 < world.twist.linear < 0.32
