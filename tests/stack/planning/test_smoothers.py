"""Smoothers by name: their effect on a polyline, and that they never cause a collision."""

import numpy as np
import pytest

from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.geometry.savitzky_golay import savitzky_golay_weights
from stack.planning.search import StepCosts
from stack.planning.smoothers.choice import SMOOTHERS, shape, smooth
from stack.planning.smoothers.shapes import savitzky_golay
from stack.planning.smoothing import PathCosts
from stack.types import (
    FREE,
    INSCRIBED_COST,
    LETHAL_COST,
    OCCUPIED,
    CostGrid,
    Footprint,
    OccupancyGrid,
)

TRAVERSE = StepCosts.of(3.0, True).traverse


def open_floor():
    return CostGrid(np.zeros((120, 120), dtype=np.uint8), 0.05)


def bends(points):
    directions = np.unwrap(np.arctan2(*np.diff(points, axis=0).T[::-1]))
    return np.abs(np.diff(directions))


def test_the_filter_has_the_published_coefficients():
    # Savitzky and Golay 1964, table I: seven points, quadratic or cubic; nine points
    assert savitzky_golay_weights(3, 3) * 21 == pytest.approx([-2, 3, 6, 7, 6, 3, -2])
    nine = [-21, 14, 39, 54, 59, 54, 39, 14, -21]
    assert savitzky_golay_weights(4, 2) * 231 == pytest.approx(nine)


def test_the_filter_keeps_cubics_and_ends_and_removes_noise():
    x = np.linspace(0.0, 2.0, 41)
    cubic = np.column_stack([x, x**3 - x])
    smooth = savitzky_golay(cubic)
    assert smooth[6:-6] == pytest.approx(cubic[6:-6], abs=1e-9)
    noisy = cubic + np.random.default_rng(1).normal(0.0, 0.01, cubic.shape)
    smooth = savitzky_golay(noisy)
    assert smooth[[0, -1]] == pytest.approx(noisy[[0, -1]])
    assert np.std((smooth - cubic)[6:-6]) < 0.7 * np.std((noisy - cubic)[6:-6])


def test_the_constrained_smoother_widens_a_corner_towards_its_radius():
    corner = np.vstack(
        [np.column_stack([np.linspace(1, 3, 41), np.full(41, 2.0)]),
         np.column_stack([np.full(40, 3.0), np.linspace(2.05, 4, 40)])]
    )  # fmt: skip
    smooth = shape("constrained", open_floor(), corner, 0.4, pinned=1)
    assert bends(corner).max() == pytest.approx(np.pi / 2)
    assert bends(smooth).max() < 0.05 / 0.3  # per step of 5 cm
    assert smooth[[0, -1]] == pytest.approx(corner[[0, -1]])


def test_the_constrained_smoother_moves_away_from_a_wall():
    cells = np.full((120, 120), FREE, dtype=np.int8)
    cells[:30] = OCCUPIED  # up to y = 1.5
    costs = Costmap(CostmapParameters(), Footprint.circle(0.22), OccupancyGrid(cells, 0.05)).grid
    along = np.column_stack([np.linspace(1, 5, 81), np.full(81, 1.85)])
    smooth = shape("constrained", costs, along, 0.5, pinned=1)
    assert smooth[40, 1] > 1.87  # by two centimetres and more: the slope there is gentle


@pytest.mark.parametrize("name", SMOOTHERS)
def test_the_raw_line_stays_where_smoothing_would_collide(name):
    costs = open_floor()
    costs.cells[:] = LETHAL_COST
    costs.cells[64, 20:65] = costs.cells[20:65, 64] = 0  # an angle one cell wide
    corner = np.array([[1.025, 3.225], [3.225, 3.225], [3.225, 1.025]])
    path = smooth(name, PathCosts(costs, TRAVERSE), corner, 0.5)
    assert path.points[[0, -1], :2] == pytest.approx(corner[[0, -1]])
    assert path.points[-1, 2] == 0.5
    assert max(costs.cells[costs.cell_at(x, y)] for x, y, _ in path.points) < INSCRIBED_COST


@pytest.mark.parametrize("name", SMOOTHERS)
def test_two_points_are_enough(name):
    path = smooth(name, PathCosts(open_floor(), TRAVERSE), np.array([[1, 1], [1.3, 1]]), 0.0)
    assert path.length == pytest.approx(0.3)
