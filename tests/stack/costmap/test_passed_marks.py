"""Marks between the beams of a robot that stands: what has gone goes, what may be there stays."""

from math import inf, nan, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.types import Footprint, Pose2D, Scan
from tests.stack.costmap.marks import seen, sensed

PARAMETERS = CostmapParameters(
    inflation_radius=0.0, resolution=0.025, obstacle_range=6.0, clearing_range=7.0
)


def costmap():
    layers = read_layers(["obstacle"], PARAMETERS)
    return Costmap(PARAMETERS, Footprint.circle(0.02), None, window=12.0, layers=layers)


def wall_scan(here, distance, beams, field=2.0 * pi, turn=1.0):
    """Of a lidar that sees a wall at x = `distance`, 1 m long, in a wide empty room."""
    increment = turn * field / beams
    angle_min = -turn * field / 2.0
    angles = here.heading + angle_min + increment * np.arange(beams)
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (distance - here.x) / np.cos(angles)
        y = here.y + away * np.sin(angles)
    ranges = np.where((away > 0.0) & (np.abs(y) < 0.5), away, 9.0)
    return Scan(0.0, ranges.astype(np.float32), angle_min, increment, 0.05, 12.0)


def approach(here, distance, beams, **kind):
    """Drive 0.5 m towards the wall, so that its marks are closed."""
    for step in range(21):
        pose = Pose2D(-0.5 + 0.025 * step, 0.003 * step, 0.001 * step)
        here.update(seen(pose, wall_scan(pose, distance, beams, **kind), 0.1 * step))
    return pose


def stand(here, pose, scan, until):
    for step in range(21, int(10 * until)):
        here.update(seen(pose, scan, 0.1 * step))


def marks_of_wall(here, distance):
    marked = sensed(here)
    columns = here.grid.origin[0] + 0.025 * (np.arange(marked.shape[1]) + 0.5)
    return marked[:, np.abs(columns - distance) < 0.2].sum()


@settings(deadline=None, max_examples=60)
@given(
    distance=st.floats(0.8, 4.0), beams=st.integers(300, 1500), turn=st.sampled_from([1.0, -1.0]),
    field=st.sampled_from([2.0 * pi, 1.5 * pi]),
)  # fmt: skip
def test_a_door_that_opens_before_a_standing_robot_is_open(distance, beams, turn, field):
    here = costmap()
    pose = approach(here, distance, beams, turn=turn, field=field)
    assert marks_of_wall(here, distance) >= 10
    stand(here, pose, wall_scan(pose, 9.0, beams, turn=turn, field=field), 8.0)
    assert marks_of_wall(here, distance) == 0


def test_cells_between_beams_stay_for_some_seconds():
    """A degree is 5 cm at 3 m: a leg of a chair is met at times only."""
    here = costmap()
    pose = approach(here, 3.0, 360)
    before = marks_of_wall(here, 3.0)
    stand(here, pose, wall_scan(pose, 9.0, 360), 4.0)
    assert 0 < marks_of_wall(here, 3.0) < before


@pytest.mark.parametrize("beams", [12, 60, 170])
def test_beams_far_apart_show_nothing_of_what_is_between_them(beams):
    """170 beams are 11 cm apart at 3 m."""
    here = costmap()
    pose = approach(here, 3.0, beams)
    stand(here, pose, wall_scan(pose, 9.0, beams), 4.0)
    left = marks_of_wall(here, 3.0)
    assert left > 0
    stand(here, pose, wall_scan(pose, 9.0, beams), 20.0)
    assert marks_of_wall(here, 3.0) == left


@pytest.mark.parametrize("value", [2.0, nan, 0.0])
def test_marks_that_are_hidden_or_not_measured_stay(value):
    """Something nearer hides them, or the beams there are invalid."""
    here = costmap()
    pose = approach(here, 3.0, 360)
    before = marks_of_wall(here, 3.0)
    scan = wall_scan(pose, 9.0, 360)
    ranges = np.full(360, value, np.float32)
    stand(here, pose, Scan(0.0, ranges, scan.angle_min, scan.angle_increment, 0.05, 12.0), 20.0)
    assert marks_of_wall(here, 3.0) == before


def test_a_lost_beam_beside_clears_nothing_beyond_its_neighbours():
    here = costmap()
    pose = approach(here, 3.0, 360)
    before = marks_of_wall(here, 3.0)
    ranges = wall_scan(pose, 3.0, 360).ranges.copy()
    ranges[::2] = inf
    first = wall_scan(pose, 3.0, 360)
    stand(here, pose, Scan(0.0, ranges, first.angle_min, first.angle_increment, 0.05, 12.0), 20.0)
    assert marks_of_wall(here, 3.0) == before


@pytest.mark.parametrize(("beams", "increment"), [(1, 0.1), (2, 0.0)])
def test_a_scan_without_neighbouring_beams_is_taken(beams, increment):
    here = costmap()
    scan = Scan(0.0, np.full(beams, 2.0, np.float32), 0.0, increment, 0.05, 12.0)
    stand(here, Pose2D(0.01, 0.01), scan, 10.0)
    assert sensed(here).sum() == 1
