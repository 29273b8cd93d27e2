"""Smoothing: even spacing, small bends, and no collision with what the planner avoided."""

import numpy as np
import pytest

from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.planning.search import StepCosts
from stack.planning.smoothing import POSE_SPACING, PathCosts, resampled, smoothed, unsmoothed
from stack.types import (
    FREE,
    INSCRIBED_COST,
    LETHAL_COST,
    OCCUPIED,
    CostGrid,
    Footprint,
    OccupancyGrid,
)

TABLES = StepCosts.of(3.0, True)


def open_floor(rows=120, columns=120):
    return CostGrid(np.zeros((rows, columns), dtype=np.uint8), 0.05, (-1.0, -1.0))


def turns(path):
    return np.abs(np.diff(np.unwrap(path.points[:-1, 2])))


def gaps(path):
    return np.hypot(*np.diff(path.points[:, :2], axis=0).T)


def test_over_open_floor_the_path_is_straight():
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0]])
    zigzag = resampled(corner, 0.05)
    path = smoothed(PathCosts(open_floor(), TABLES.traverse), zigzag, 0.5)
    assert path.length == pytest.approx(np.hypot(2.0, 1.0), rel=1e-9)
    assert path.points[:-1, 2] == pytest.approx(np.arctan2(1.0, 2.0))
    assert path.points[-1, 2] == 0.5


def test_a_right_angle_round_an_obstacle_is_rounded_and_evenly_spaced():
    cells = np.full((120, 120), FREE, dtype=np.int8)
    cells[:58, :58] = OCCUPIED  # up to x, y = 1.9
    static = OccupancyGrid(cells, 0.05, (-1.0, -1.0))
    grid = Costmap(CostmapParameters(), Footprint.circle(0.22), static).grid
    raw = resampled(np.array([[0.0, 2.3], [2.3, 2.3], [2.3, 0.0]]), 0.05)
    path = smoothed(PathCosts(grid, TABLES.traverse), raw, 0.0)
    assert gaps(path) == pytest.approx(POSE_SPACING, rel=0.02)
    assert turns(path).max() < 0.25  # per 5 cm: a turning radius of 0.2 m
    assert turns(unsmoothed(raw, 0.0)).max() > 0.7
    for x, y, _ in path.points:
        assert grid.cells[grid.cell_at(x, y)] < INSCRIBED_COST


def test_corners_are_not_rounded_into_obstacles():
    grid = open_floor()
    grid.cells[:] = LETHAL_COST
    grid.cells[64, 20:65] = grid.cells[20:65, 64] = 0  # an angle one cell wide
    raw = resampled(np.array([[0.025, 2.225], [2.225, 2.225], [2.225, 0.025]]), 0.05)
    path = smoothed(PathCosts(grid, TABLES.traverse), raw, 0.0)
    for x, y, _ in path.points:
        assert grid.cells[grid.cell_at(x, y)] == 0
    assert path.length == pytest.approx(4.4, abs=0.1)


def test_a_path_does_not_leave_cheap_cells_for_a_shorter_expensive_line():
    grid = open_floor()
    grid.cells[:] = 252
    grid.cells[60, 20:61] = grid.cells[20:61, 60] = 0
    raw = resampled(np.array([[0.025, 2.025], [2.025, 2.025], [2.025, 0.025]]), 0.05)
    path = smoothed(PathCosts(grid, TABLES.traverse), raw, 0.0)
    inside = [grid.cells[grid.cell_at(x, y)] for x, y, _ in path.points]
    assert np.count_nonzero(np.array(inside) > 0) == 0


def test_the_same_path_comes_out_every_time():
    random = np.random.default_rng(1)
    grid = open_floor()
    grid.cells[random.random((120, 120)) < 0.3] = 100
    raw = resampled(random.uniform(-0.9, 4.9, (9, 2)), 0.05)
    one, other = (smoothed(PathCosts(grid, TABLES.traverse), raw, 0.0).points for _ in range(2))
    assert np.array_equal(one, other)
