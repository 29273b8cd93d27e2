"""Where the way of the map is closed."""

import numpy as np
import pytest

from stack.costmap.closed_way import closed_way
from stack.types import FREE_COST, LETHAL_COST, CostGrid, Pose2D

SIDE = 0.1


@pytest.fixture
def ground():
    """Two rooms of 5 x 4 m with an opening of 1.4 m, 5 m from the left; no outer walls."""
    cells = np.full((40, 100), FREE_COST, np.uint8)
    cells[:13, 50] = cells[27:, 50] = LETHAL_COST
    return cells


def found(ground, cells, start=Pose2D(1.0, 2.0), goal=Pose2D(9.0, 2.0), radius=0.2):
    return closed_way(CostGrid(cells, SIDE), ground, start, goal, radius)


def test_the_opening_is_named_that_something_closes(ground):
    cells = ground.copy()
    cells[13:27, 52] = LETHAL_COST
    closed = found(ground, cells)
    assert closed.at == pytest.approx((5.25, 2.05), abs=0.2)
    assert closed.length == pytest.approx(8.0, abs=0.3)
    # the centre stays 0.2 m before it: 5.2 - 1.0 - 0.2 m, in whole cells
    assert closed.open_length == pytest.approx(4.0, abs=0.2)


def test_an_obstacle_beside_the_way_closes_nothing(ground):
    cells = ground.copy()
    cells[0:5, 20:30] = LETHAL_COST
    assert found(ground, cells) is None


def test_an_obstacle_that_leaves_another_way_closes_nothing(ground):
    cells = ground.copy()
    cells[13:18, 50] = LETHAL_COST
    assert found(ground, cells) is None


def test_a_wall_of_the_map_is_no_closure(ground):
    ground[:, 50] = LETHAL_COST
    assert found(ground, ground.copy()) is None


def test_the_opening_is_too_narrow_for_a_wide_robot(ground):
    cells = ground.copy()
    cells[13:27, 52] = LETHAL_COST
    assert found(ground, cells, radius=0.8) is None


def test_start_and_goal_may_be_beside_an_obstacle_but_not_off_the_map(ground):
    cells = ground.copy()
    cells[13:27, 52] = LETHAL_COST
    ground[20, 8] = cells[20, 8] = LETHAL_COST
    assert found(ground, cells) is not None
    assert found(ground, cells, goal=Pose2D(12.0, 2.0)) is None
