"""Robots that are slow by their limits reach goals with every controller."""

from math import pi

import pytest

from stack.types import Pose2D, TaskStatus
from tests.stack.control.courses import SHAPES, controller
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyWorld, moving, room

CONTROLLERS = ("pure_pursuit", "dwb", "graceful", "mppi")
SMALLER = {"mppi": {"batch": 200}}


def drive(name, goal, **limits):
    world = ToyWorld(room(4, 4), moving("differential", SHAPES["round"], **limits), Pose2D(2, 2))
    follower = controller(name, world, **SMALLER.get(name, {})).follower
    toy = ToyDrive(world, follower=follower)
    task = toy.navigator.base.navigate_to(goal)
    toy.finish(task, 120.0)
    toy.navigator.close()
    return toy, task


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_slow_robot_turns_about_and_drives(name):
    """At 0.1 rad/s half a turn takes 31 s, at 0.03 m/s 0.24 m are driven in the 8 s of progress."""
    goal = Pose2D(1.7, 2.0, pi)
    limits = {"linear_speed": 0.03, "reverse_speed": 0.03, "angular_speed": 0.1}
    toy, task = drive(name, goal, **limits)
    assert task.status is TaskStatus.SUCCEEDED, task.failure
    assert toy.world.pose.distance_to(goal) <= 0.15
    if name == "pure_pursuit":
        assert toy.world.time > pi / 0.1


def test_a_cruise_speed_makes_a_robot_slow_too():
    world = ToyWorld(room(4, 4), moving("differential", SHAPES["round"]), Pose2D(1.0, 2.0))
    follower = controller("graceful", world, cruise_speed=0.025, min_speed=0.02).follower
    toy = ToyDrive(world, follower=follower)
    task = toy.navigator.base.navigate_to(Pose2D(2.0, 2.0))
    assert toy.finish(task) is TaskStatus.SUCCEEDED, task.failure
    toy.navigator.close()
    assert toy.world.time > 0.85 / 0.025
