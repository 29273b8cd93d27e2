"""Backing out of the way of a person, without a turn."""

from __future__ import annotations

from dataclasses import replace
from math import pi

import numpy as np
import pytest

from stack.navigation.people.backing_out import FACED, LEFT_BEHIND, SHORT, backed_out, should_turn
from stack.types import (
    ObstaclePoints,
    Path,
    Perceived,
    Pose2D,
    PoseEstimate,
    TaskStatus,
    TrackedObject,
    WorldView,
)
from tests.stack.navigation.toy_drive import ToyDrive
from tests.stack.navigation.toy_world import ToyCostmap, ToyWorld, moving, robot

HERE = Pose2D(5.0, 0.5, 0.0)

ROOM_ASIDE = [
    (0, 0, 10, 0), (10, 0, 10, 1), (10, 1, 3.5, 1), (3.5, 1, 3.5, 3), (3.5, 3, 1.5, 3),
    (1.5, 3, 1.5, 1), (1.5, 1, 0, 1), (0, 1, 0, 0),
]  # fmt: skip
"""A corridor of 1 m along x, with a room beside it from x = 1.5 to 3.5 m."""


def straight(end: float) -> Path:
    """A path from HERE along x."""
    x = np.linspace(HERE.x, end, 40)
    heading = 0.0 if end > HERE.x else pi
    return Path(np.column_stack([x, np.full(40, HERE.y), np.full(40, heading)]))


def person(x: float, y: float, speed: float = 0.0) -> TrackedObject:
    return TrackedObject(7, 0.0, (x, y), (speed, 0.0), 0.25, 0.01 * np.eye(4))


def state(*people: TrackedObject, obstacles: ObstaclePoints | None = None) -> Perceived:
    toy = ToyWorld(ROOM_ASIDE, robot(), HERE)
    estimate = PoseEstimate(HERE, 1e-4 * np.eye(3), 0.9)
    world = WorldView(people)
    return Perceived(0.0, estimate, toy.odometry, obstacles or ObstaclePoints(), world=world)


def is_backward(path: Path) -> bool:
    """Whether the robot drives the inside of a path against its headings."""
    step = path.points[2] - path.points[1]
    return bool(np.cos(path.points[1, 2]) * step[0] + np.sin(path.points[1, 2]) * step[1] < 0.0)


CLOSE = ObstaclePoints(points=np.array([[0.25, 0.0]]))
"""Something in front, too close to turn: the circumscribed radius is 0.33 m."""

NARROW = ObstaclePoints(points=np.array([[0.0, 0.6], [0.1, -0.6]]))
"""Walls of a corridor of 1.2 m: 0.66 m for a turning robot, 0.5 for a person, 0.15 between them."""

BLIND = ObstaclePoints(blind_sectors=np.array([[0.75 * pi, 0.5 * pi]]))
FACING = person(HERE.x + 0.8 * FACED, HERE.y)


@pytest.mark.parametrize(
    ("end", "now", "backward"),
    [
        (HERE.x - 1.5, state(FACING), True),
        (HERE.x + 1.5, state(FACING), False),  # leads forward
        (HERE.x - 1.5, state(), False),  # nobody
        (HERE.x - 1.5, state(person(HERE.x - 0.8, HERE.y)), False),  # behind the robot
        (HERE.x - 1.5, state(person(HERE.x + 1.2 * FACED, HERE.y)), False),  # not close
        (HERE.x - 3.0, state(obstacles=CLOSE), True),  # no room to turn
        (HERE.x - 3.0, state(FACING), False),  # two turns are faster than a slow reverse
        (HERE.x - 3.0, state(FACING, obstacles=NARROW), True),  # they would touch it as it turns
        (HERE.x - 1.5, state(FACING, obstacles=BLIND), False),  # nothing is seen behind
    ],
)
def test_the_way_from_a_person_in_front_is_driven_backward(end, now, backward):
    toy = ToyDrive(ToyWorld(ROOM_ASIDE, robot(), HERE))
    path = straight(end)
    driven = backed_out(path, now, toy.navigator.tools)
    assert is_backward(driven) is backward
    assert np.array_equal(driven.points[:, :2], path.points[:, :2])
    toy.navigator.close()


@pytest.mark.parametrize(
    ("remaining", "now", "turns"),
    [
        (SHORT + 1.0, state(), True),
        (SHORT - 0.5, state(), False),
        (SHORT + 1.0, state(FACING), False),
        (SHORT + 1.0, state(person(HERE.x + LEFT_BEHIND + 0.1, HERE.y)), True),
        (SHORT + 1.0, state(obstacles=CLOSE), False),
    ],
)
def test_a_robot_turns_round_as_soon_as_it_has_left_everybody_behind(remaining, now, turns):
    """Unless a slow reverse takes no longer than two turns."""
    toy = ToyDrive(ToyWorld(ROOM_ASIDE, robot(), HERE))
    assert should_turn(remaining, now, toy.navigator.tools) is turns
    toy.navigator.close()


@pytest.mark.parametrize("kind", ["omni", "ackermann"])
def test_only_robots_that_turn_in_place_and_need_to_turn_back_out(kind):
    toy = ToyDrive(ToyWorld(ROOM_ASIDE, moving(kind), HERE))
    path = straight(HERE.x - 1.5)
    assert backed_out(path, state(FACING, obstacles=CLOSE), toy.navigator.tools) is path
    toy.navigator.close()


def test_limits_of_speed_and_partial_ends_are_kept():
    toy = ToyDrive(ToyWorld(ROOM_ASIDE, robot(), HERE))
    path = replace(straight(HERE.x - 1.5), speed_limits=np.full(40, 0.4), partial=True)
    driven = backed_out(path, state(FACING), toy.navigator.tools)
    assert driven.partial
    assert driven.speed_limits is path.speed_limits
    toy.navigator.close()


def test_a_robot_backs_out_before_somebody_who_walks_into_it():
    """Slowly, in a corridor of 1 m: it has no room to turn, and leaves it for the room aside."""
    world = ToyWorld(ROOM_ASIDE, robot(reverse_speed=0.3), HERE, [(7.0, 0.5, 0.25)])
    toy = ToyDrive(world, person_patience=60.0)
    toy.globe = toy.navigator.tools.global_costmap = ToyCostmap(ToyWorld(ROOM_ASIDE, robot()))
    front, headings = world.robot.footprint.points[:, 0].max(), []

    def walk() -> list[TrackedObject]:
        x, y, radius = world.circles[0]
        is_in_way = world.pose.y < 1.0 and world.pose.x < x
        least = world.pose.x + front + radius + 0.02 if is_in_way else 0.5
        there = max(x - 0.3 * world.period, least)
        world.circles[0] = (there, y, radius)
        headings.append(abs(world.pose.heading) if world.pose.x > 3.8 and is_in_way else 0.0)
        return [replace(person(there, y, (there - x) / world.period), stamp=world.time)]

    toy.tracks = walk
    task = toy.navigator.base.navigate_to(Pose2D(9.0, 0.5))
    assert toy.finish(task, 90.0) is TaskStatus.SUCCEEDED, task.failure
    assert "give_way" in toy.kinds()
    assert max(headings) < 0.5  # it did not turn across the corridor
    assert world.nearest > 0.0
    toy.navigator.close()
