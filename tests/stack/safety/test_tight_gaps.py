"""What the safety stage does in gaps narrower than its padding."""

from __future__ import annotations

from dataclasses import replace

import pytest

from stack.errors import ParameterError
from stack.parameters import build
from stack.safety.parameters import SafetyParameters
from stack.types import Footprint, Pose2D, Twist
from tests.stack.navigation.toy_world import RECTANGLE, ToyWorld, robot, room
from tests.stack.safety.obstacles import SafetyStage, drive_until_still

PARAMETERS = SafetyParameters()


def through(gap, speed=0.6, parameters=PARAMETERS):
    """How fast a box 0.4 m wide gets on between two walls, and the least that was free."""
    middle = 4.0
    posts = [(3, 0, 3, middle - gap / 2), (5, 0, 5, middle - gap / 2),
             (3, middle - gap / 2, 5, middle - gap / 2), (3, middle + gap / 2, 5, middle + gap / 2),
             (3, middle + gap / 2, 3, 8), (5, middle + gap / 2, 5, 8)]  # fmt: skip
    world = ToyWorld(room(8, 8) + posts, robot(), Pose2D(1.5, middle), beams=720)
    safety = SafetyStage(world.robot, parameters, world.period)
    inside = []
    for _ in range(500):
        twist = safety.limit(Twist(speed), world.odometry, world.obstacles)
        world.drive(twist)
        if 3.0 < world.pose.x < 4.5:
            inside.append(twist.linear)
    return world, inside


@pytest.mark.parametrize(("beside", "speed"), [(0.016, 0.15), (0.02, 0.2625), (0.025, 0.375)])
def test_a_gap_within_the_padding_is_passed_the_faster_the_wider_it_is(beside, speed):
    """1.5 cm on either side are enough for 0.15 m/s, 3 cm for 0.6 m/s and more, and in between in
    proportion, rounded down to quarters: 2 cm are a third of the way, 2.5 cm two thirds."""
    world, speeds = through(0.4 + 2.0 * beside)
    assert world.pose.x > 5.0
    assert max(speeds) == pytest.approx(speed)
    assert world.nearest == pytest.approx(beside, abs=1e-3)


def test_who_asks_for_what_the_room_allows_gets_it_and_without_a_tight_speed_nothing():
    """2 cm are a third of the way from 1.5 cm, for 0.15 m/s, to 3 cm, for 0.6 m/s: 0.3 m/s."""
    _, speeds = through(0.4404, speed=0.3)
    assert min(speeds) == max(speeds) == pytest.approx(0.3)
    world, speeds = through(0.44, parameters=replace(PARAMETERS, tight_speed=0.0))
    assert world.pose.x < 3.0 and not speeds
    careful = SafetyStage(world.robot, replace(PARAMETERS, tight_speed=0.0), world.period)
    assert careful._padding(Twist(0.1)) == PARAMETERS.padding


def test_who_asks_for_less_than_a_crawl_gets_it_in_a_gap_within_the_padding():
    _, speeds = through(0.44, speed=0.1)
    assert min(speeds) == max(speeds) == pytest.approx(0.1)


def test_a_wider_one_is_passed_as_it_was_asked_for():
    _, speeds = through(0.56)
    assert max(speeds) == pytest.approx(0.6)


def test_a_gap_too_tight_for_a_crawl_stops_the_robot_before_it():
    world, speeds = through(0.42)
    assert world.pose.x < 3.0 and not speeds
    assert world.nearest > 0.0


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_beside_a_post_within_the_padding_it_turns_a_little_nearer(side):
    """A post 2.9 cm from the side, 0.1 m before the base: turning brings it nearer by 0.1 m a
    radian at first, to the 1.5 cm of a crawl after 0.12 rad; at half of that it is slower than a
    creep."""
    posts = [(4.1, 4.0 + side * (0.229 + 0.05), 0.05)]
    world = ToyWorld(room(8, 8), robot(), Pose2D(4.0, 4.0), posts, beams=1440)
    safety = SafetyStage(world.robot, PARAMETERS, world.period)
    for _ in range(100):
        world.drive(safety.limit(Twist(angular=side), world.odometry, world.obstacles))
    assert 0.05 < side * world.pose.heading < 0.12
    assert PARAMETERS.tight_padding < world.nearest < 0.025


@pytest.mark.parametrize(("footprint", "speed"), [(Footprint.circle(0.22), 1.0), (RECTANGLE, 0.0)])
def test_only_a_round_robot_turns_freely_where_it_touches_a_wall(footprint, speed):
    pose = Pose2D(4.0, -footprint.points[:, 1].min() - 0.005)
    world = ToyWorld(room(8, 8), robot(footprint), pose, beams=1440)
    safety = SafetyStage(world.robot, PARAMETERS, world.period)
    for _ in range(20):
        twist = safety.limit(Twist(angular=1.0), world.odometry, world.obstacles)
    assert twist.angular == pytest.approx(speed)


@pytest.mark.parametrize(
    ("given", "least"), [({"creep_speed": 0.004}, 0.005), ({"slow_time": 0.25}, 0.02)]
)
def test_settings_with_which_it_would_creep_into_an_obstacle_are_refused(given, least):
    """It stops creep_speed x slow_time before one: this must be more than the slack of 5 mm."""
    with pytest.raises(ParameterError, match="would creep into obstacles") as caught:
        build(SafetyParameters, given)
    assert caught.value.hint == f"use more than {least:g} m/s, or a longer slow_time"
    world = ToyWorld(room(3, 3), robot(), Pose2D(1.5, 1.5), beams=720)
    parameters = build(SafetyParameters, {**given, "creep_speed": 1.1 * least})
    safety = SafetyStage(world.robot, parameters, world.period)
    drive_until_still(world, safety, Twist(0.3), 60.0)
    assert safety.reason.startswith("stopped") and world.nearest > 0.0
