"""Sonars against closed forms."""

from dataclasses import replace
from math import inf, isnan, sin

import numpy as np
import pytest

from stack.drivetrain.description import SonarDescription
from stack.sim.scene_state import SceneState
from stack.sim.sensors.sonar import Sonar
from stack.sim.worlds.world import Box
from stack.types import Pose2D
from tests.stack.sim.sim_rover import EMPTY, square_room

SONAR = SonarDescription(Pose2D(0.2, 0.0), height=0.06, noise=0.0, field_of_view=0.5)
NOBODY = np.zeros((0, 3))


def hear(world, description=SONAR, pose=Pose2D(0.0, 0.0), people=NOBODY, step=0):
    return Sonar(description, world, 1, "front").reading(pose, SceneState(people), step, 2.5)


def test_a_wall_is_as_far_as_its_nearest_point():
    reading = hear(square_room(2.0))
    assert reading.distance == pytest.approx(2.0 - 0.2, abs=1e-6)  # the middle ray is square to it
    assert (reading.stamp, reading.source, reading.mount) == (2.5, "front", SONAR.mount)


def test_something_at_the_edge_of_the_cone_counts():
    """A slanted view: the ray at the cone's edge meets the left wall first."""
    turned = replace(SONAR, mount=Pose2D(0.2, 0.0, 1.0))
    assert hear(square_room(2.0), turned).distance == pytest.approx(2.0 / sin(1.25), abs=1e-6)


def test_only_obstacles_that_reach_above_the_sensor_are_measured():
    ahead = Pose2D(1.5, 0.0)
    assert hear(replace(EMPTY, boxes=(Box(ahead, (0.2, 2.0, 0.05)),))).distance == inf
    heard = hear(replace(EMPTY, boxes=(Box(ahead, (0.2, 2.0, 0.14)),))).distance
    assert heard == pytest.approx(1.4 - 0.2, abs=1e-6)


def test_too_near_is_invalid_and_too_far_no_return():
    assert isnan(hear(square_room(0.22)).distance)
    assert hear(square_room(3.0)).distance == inf


def test_people_are_measured_and_noise_depends_on_seed_and_step():
    noisy = replace(SONAR, noise=0.02)
    ada = np.array([[1.2, 0.0, 0.25]])
    first, again = (hear(EMPTY, noisy, people=ada, step=7).distance for _ in range(2))
    assert first == again != hear(EMPTY, noisy, people=ada, step=8).distance
    assert first == pytest.approx(1.2 - 0.25 - 0.2, abs=0.08)  # 4 sigma
