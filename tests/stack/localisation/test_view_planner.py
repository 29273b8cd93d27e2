"""The view from which rivals differ: reachable at all of them, nearest first."""

from math import pi

import numpy as np
import pytest

from stack.localisation import view_planner
from stack.localisation.distance_field import surface_field
from stack.localisation.kernels import cast_rays
from stack.localisation.view_planner import ViewPlanner
from stack.types import Pose2D, Scan
from tests.stack.localisation.drawn_office import drawn, mapped

WALLS = [
    (0.0, 0.0, 20.0, 0.1), (0.0, 7.9, 20.0, 8.0), (0.0, 0.0, 0.1, 8.0), (19.9, 0.0, 20.0, 8.0),
    # corridor at the bottom, two rooms of 4 m with doors of 1 m at the same place in each
    (0.0, 3.0, 4.0, 3.1), (5.0, 3.0, 14.0, 3.1), (15.0, 3.0, 20.0, 3.1),
    (2.0, 3.0, 2.1, 8.0), (7.0, 3.0, 7.1, 8.0), (12.0, 3.0, 12.1, 8.0), (17.0, 3.0, 17.1, 8.0),
]  # fmt: skip
PRINTER = (6.0, 0.1, 6.8, 0.8)
ROBOT, TWIN = Pose2D(3.5, 6.0, -pi / 2), Pose2D(13.5, 6.0, -pi / 2)


def scan(beams=360, field_of_view=2.0 * pi):
    step = field_of_view / beams
    return Scan(
        0.0, np.ones(beams, np.float32), -field_of_view / 2, step, 0.08, 8.0, Pose2D(0.1, 0)
    )


def planner(*furniture):
    solid = drawn([*WALLS, *furniture], 20.0, 8.0)
    field = surface_field(mapped(solid))
    return ViewPlanner(field, 0.3), field


def test_the_view_is_reachable_at_both_and_near():
    views, field = planner(PRINTER)
    view = views.best_view([ROBOT, TWIN], [0.5, 0.5], scan())
    assert view is not None
    for pose in (ROBOT, TWIN):
        place = pose.compose(view.motion)
        row, column = int(place.y / 0.05), int(place.x / 0.05)
        assert field.occupancy[row, column] == 0
        assert field.distances[row, column] >= 0.25
    straight = view.motion.distance_to(Pose2D(0.0, 0.0))
    assert straight - 0.1 <= view.distance < 2.0 * straight
    assert 0.3 < view.gain <= 1.0


def test_equal_surroundings_have_no_view():
    room = [
        (0.0, 0.0, 10.0, 0.1), (0.0, 7.9, 10.0, 8.0), (0.0, 0.0, 0.1, 8.0), (9.9, 0.0, 10.0, 8.0),
        (2.0, 2.0, 3.0, 2.5), (6.0, 5.0, 7.5, 5.5),
    ]  # fmt: skip
    walls = [(a + shift, b, c + shift, d) for shift in (0.0, 10.0) for a, b, c, d in room]
    field = surface_field(mapped(drawn(walls, 20.0, 8.0)))
    views = ViewPlanner(field, 0.3)
    poses = [Pose2D(4.0, 4.0, 0.3), Pose2D(14.0, 4.0, 0.3)]
    assert views.best_view(poses, [0.5, 0.5], scan()) is None


def test_an_avoided_place_is_not_chosen_again():
    views, _ = planner(PRINTER)
    first = views.best_view([ROBOT, TWIN], [0.5, 0.5], scan())
    second = views.best_view([ROBOT, TWIN], [0.5, 0.5], scan(), [first.motion])
    assert second is None or second.motion.distance_to(first.motion) > 1.0


def test_a_place_beyond_the_reach_is_not_chosen(monkeypatch):
    monkeypatch.setattr(view_planner, "VIEW_DISTANCE", 0.35)
    views, _ = planner(PRINTER)
    assert views.best_view([ROBOT, TWIN], [0.5, 0.5], scan()) is None


@pytest.mark.parametrize("shares", [[0.5, 0.5], [0.9, 0.1]])
def test_a_lidar_that_looks_ahead_is_turned_to_the_difference(shares):
    views, field = planner(PRINTER)
    ahead = scan(120, pi / 2)
    view = views.best_view([ROBOT, TWIN], shares, ahead)
    place = ROBOT.compose(view.motion)
    twin = TWIN.compose(view.motion)
    ranges = [
        cast_rays(field.occupancy, field.placement, np.array([p.x, p.y, p.heading]),
                  ahead.angles, 8.0)
        for p in (place, twin)
    ]  # fmt: skip
    assert np.mean(np.abs(np.minimum(ranges[0], 8.0) - np.minimum(ranges[1], 8.0)) > 0.3) > 0.05
