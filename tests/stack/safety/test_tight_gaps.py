"""What the safety stage makes of lidar noise, and of gaps narrower than its padding."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.perception.obstacle_memory import MOST_SHIFT, SAME_SURFACE, steadied
from stack.safety.parameters import SafetyParameters
from stack.safety.safety import Safety
from stack.types import Pose2D, Twist
from tests.stack.navigation.toy_world import ToyWorld, robot, room

ANGLES = np.radians(np.arange(-40.0, 40.0, 0.5))
PARAMETERS = SafetyParameters()


def wall(distance, noise=0.0, seed=0):
    """(160, 2) what a lidar sees of a flat wall ahead."""
    ranges = distance / np.cos(ANGLES) + np.random.default_rng(seed).normal(0.0, noise, 160)
    return np.column_stack([ranges * np.cos(ANGLES), ranges * np.sin(ANGLES)])


@pytest.mark.parametrize("distance", [0.3, 1.0, 4.0])
def test_a_flat_wall_without_noise_stays_what_it_is(distance):
    steady = steadied(wall(distance))
    assert steady[:, 0] == pytest.approx(distance)
    assert np.linalg.norm(steady - wall(distance), axis=1).max() < SAME_SURFACE


def test_noise_on_a_wall_shrinks_as_the_mean_of_seven_does():
    """Noise of 3 mm, which hardly ever moves a point by MOST_SHIFT."""
    noisy = np.concatenate([wall(0.4, 0.003, seed)[20:-20, 0] for seed in range(20)])
    steady = np.concatenate([steadied(wall(0.4, 0.003, seed))[20:-20, 0] for seed in range(20)])
    assert noisy.std() == pytest.approx(0.003, rel=0.1)
    assert steady.std() == pytest.approx(0.003 / 7**0.5, rel=0.15)


def test_no_point_moves_farther_than_what_is_kept_free_allows():
    noisy = wall(0.4, 0.02, 3)
    moved = np.linalg.norm(steadied(noisy) - noisy, axis=1)
    assert moved.max() <= MOST_SHIFT + 1e-12 < PARAMETERS.tight_padding


def test_what_one_beam_sees_stays_where_it_is():
    points = wall(2.0)
    points[80] *= 0.5
    assert steadied(points)[80].tolist() == points[80].tolist()


@settings(max_examples=50)
@given(st.integers(0, 3))
def test_few_points_are_no_trouble(count):
    assert steadied(wall(1.0)[:count]).shape == (count, 2)


def through(gap, speed=0.6):
    """How fast a box 0.4 m wide gets on between two walls, and the least that was free."""
    middle = 4.0
    posts = [(3, 0, 3, middle - gap / 2), (5, 0, 5, middle - gap / 2),
             (3, middle - gap / 2, 5, middle - gap / 2), (3, middle + gap / 2, 5, middle + gap / 2),
             (3, middle + gap / 2, 3, 8), (5, middle + gap / 2, 5, 8)]  # fmt: skip
    world = ToyWorld(room(8, 8) + posts, robot(), Pose2D(1.5, middle), beams=720)
    safety = Safety(world.robot, PARAMETERS, world.period)
    inside = []
    for _ in range(500):
        twist = safety.limit(Twist(speed), world.odometry, world.obstacles)
        world.drive(twist)
        if 3.0 < world.pose.x < 4.5:
            inside.append(twist.linear)
    return world, inside


def test_a_gap_within_the_padding_is_passed_at_a_crawl():
    """2 cm on either side: less than the padding of 3 cm, more than the 1.5 cm of a crawl."""
    world, speeds = through(0.44)
    assert world.pose.x > 5.0
    assert max(speeds) <= PARAMETERS.tight_speed + 1e-9
    assert world.nearest == pytest.approx(0.02, abs=1e-3)


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
