"""Local matching: the pose within a metre and 30 degrees, with its covariance."""

from math import pi, radians

import numpy as np

from stack.localisation.distance_field import surface_field
from stack.localisation.health import ScanEvaluator
from stack.localisation.search.map_search import MapSearch
from stack.types import Pose2D, wrap_angle
from tests.stack.localisation.drawn_office import Place, drawn, mapped, office


def matcher(grid):
    field = surface_field(grid)
    return MapSearch(field, ScanEvaluator(field, 0.01), 0.01)


def test_a_pose_within_the_window_is_found():
    place, generator = office(), np.random.default_rng(1)
    local = matcher(place.grid)
    for _ in range(25):
        pose = place.free_pose(generator)
        shift = generator.uniform([-0.9, -0.9, -0.5], [0.9, 0.9, 0.5])
        guess = Pose2D(pose.x + shift[0], pose.y + shift[1], wrap_angle(pose.heading + shift[2]))
        best = local.near(guess, place.scan(pose, 0.0, generator), 1.0, radians(30.0))[0]
        assert best.pose.distance_to(pose) < 0.06
        assert abs(wrap_angle(best.pose.heading - pose.heading)) < 0.03
        assert best.fit > 0.9


def test_a_pose_outside_the_window_is_not():
    place, generator = office(), np.random.default_rng(2)
    local = matcher(place.grid)
    for _ in range(10):
        pose = place.free_pose(generator)
        guess = pose.compose(Pose2D(0.0, 0.0, pi / 2))
        found = local.near(guess, place.scan(pose, 0.0, generator), 1.0, radians(30.0))
        assert not found or found[0].fit < 0.75


def test_the_covariance_is_long_in_a_corridor():
    walls = drawn([(0.0, 0.9, 30.0, 1.0), (0.0, 2.6, 30.0, 2.7)], 30.0, 3.5)
    place, pose = Place(walls, mapped(walls)), Pose2D(15.0, 1.8, 0.02)
    scan = place.scan(pose, 0.0, np.random.default_rng(4))
    found = matcher(place.grid).near(pose, scan, 1.0, radians(30.0))
    along, across = np.sqrt(np.diag(found[0].covariance))[:2]
    assert along > 0.3 > 0.02 > across
    # The corridor looks alike everywhere; every half metre is another place.
    assert len(found) >= 3
    assert all(match.fit > 0.9 for match in found)
