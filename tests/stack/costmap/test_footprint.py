"""Footprint checks against hand-placed obstacles."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap.footprint import first_blocked, footprint_cost, path_is_clear
from stack.types import FREE_COST, LETHAL_COST, UNKNOWN_COST, CostGrid, Footprint, Pose2D

BAR = Footprint(np.array([[-0.1, -0.1], [0.5, -0.1], [0.5, 0.1], [-0.1, 0.1]]))


def grid_with(*occupied, cost=LETHAL_COST):
    cells = np.zeros((80, 80), dtype=np.uint8)
    grid = CostGrid(cells, 0.05, (-2.0, -2.0))
    for place in occupied:
        cells[grid.cell_at(*place)] = cost
    return grid


def test_interior_and_outline_count_and_heading_turns_the_outline():
    grid = grid_with((0.3, 0.0))
    assert footprint_cost(grid, BAR, Pose2D(0.0, 0.0)) == LETHAL_COST
    assert footprint_cost(grid, BAR, Pose2D(0.0, 0.0, pi / 2)) == FREE_COST
    assert footprint_cost(grid, BAR, Pose2D(0.3, -0.4, pi / 2)) == LETHAL_COST


@pytest.mark.parametrize(
    ("x", "y", "cell"),
    [(0.0, 0.01, (0.2, 0.12)), (0.0, -0.01, (0.2, -0.12)), (0.01, 0.0, (0.52, 0.02)),
     (-0.01, 0.0, (-0.12, 0.02))],
)  # fmt: skip
def test_a_cell_that_an_edge_reaches_by_a_centimetre_counts(x, y, cell):
    """The bar is 0.6 m by 0.2 m; its edges lie on the sides of cells until it moves by 1 cm."""
    assert footprint_cost(grid_with(cell), BAR, Pose2D(x, y)) == LETHAL_COST
    assert footprint_cost(grid_with(cell), BAR, Pose2D(-3.0 * x, -3.0 * y)) == FREE_COST


def test_outside_and_unknown_count_as_asked():
    outside = Pose2D(1.8, 0.0)
    assert footprint_cost(grid_with(), BAR, outside) == UNKNOWN_COST
    assert footprint_cost(grid_with(), BAR, outside, unknown=FREE_COST) == FREE_COST
    grid = grid_with((0.3, 0.0), cost=UNKNOWN_COST)
    assert footprint_cost(grid, BAR, Pose2D(0.0, 0.0), unknown=LETHAL_COST) == LETHAL_COST


@given(
    st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-pi, pi), st.floats(0, 1), st.floats(0, 1)
)
@settings(deadline=None, max_examples=200)
def test_no_cell_under_the_footprint_is_missed(x, y, heading, forward, left):
    # a point at least 7 cm inside lies in a cell (5 cm, diagonal 7.07 cm) wholly inside
    pose = Pose2D(x, y, heading)
    inside = pose.compose(Pose2D(-0.029 + 0.458 * forward, -0.029 + 0.058 * left))
    assert footprint_cost(grid_with((inside.x, inside.y)), BAR, pose) == LETHAL_COST


def test_a_path_is_checked_pose_by_pose():
    points = np.column_stack([np.linspace(-1.5, 1.5, 31), np.zeros(31), np.zeros(31)])
    grid = grid_with((0.525, 0.3))
    assert path_is_clear(grid, points, 0.2)
    assert first_blocked(grid, points, 0.2) is None
    # a cell 0.25..0.30 m aside; the round robot of 0.27 m reaches it where x is within 0.1 m
    index = first_blocked(grid, points, 0.27)
    assert index is not None and points[index, 0] == pytest.approx(0.45, abs=0.06)
    assert not path_is_clear(grid, points, Footprint.circle(0.27))
    assert path_is_clear(grid, points + np.array([1.0, 0.0, 0.0]), 0.2)
    assert not path_is_clear(grid, points + np.array([1.0, 0.0, 0.0]), 0.2, unknown=UNKNOWN_COST)
