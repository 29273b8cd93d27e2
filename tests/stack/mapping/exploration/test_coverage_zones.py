"""Coverage leaves keep-out zones out and says which they are."""

import numpy as np

from stack.mapping.exploration.coverage import coverage_plan
from stack.types import FREE, OccupancyGrid, Pose2D

GRID = OccupancyGrid(np.full((80, 120), FREE, np.int8), 0.05)  # 6 x 4 m
BED = np.zeros((80, 120), np.bool_)
BED[30:50, 20:36] = True  # x 1.0..1.8, y 1.5..2.5
POSE = Pose2D(3.0, 3.0)


def plan(corners):
    area = None if corners is None else np.array(corners)
    return coverage_plan(GRID, POSE, 0.25, 0.4, area, {"bed": BED})


def test_lanes_and_points_lie_outside_the_zone():
    found = plan([[0, 0], [6, 0], [6, 4], [0, 4]])
    assert found.zones == ("bed",) and len(found.points) == 80 * 120 - 20 * 16
    for start, end in found.lanes:
        share = np.linspace(0.0, 1.0, 200)[:, None]
        line = (1 - share) * (start.x, start.y) + share * (end.x, end.y)
        beyond = np.abs(line - (1.4, 2.0)) - (0.4, 0.5)
        assert np.hypot(*np.maximum(beyond, 0.0).T).min() > 0.25 - 0.05


def test_an_area_in_the_zone_has_no_lanes_and_names_it():
    found = plan([[1.1, 1.6], [1.7, 1.6], [1.7, 2.4], [1.1, 2.4]])
    assert (found.lanes, found.zones, len(found.points)) == ((), ("bed",), 0)


def test_an_area_away_from_the_zone_names_none():
    assert plan([[3, 0.5], [5, 0.5], [5, 3], [3, 3]]).zones == ()
