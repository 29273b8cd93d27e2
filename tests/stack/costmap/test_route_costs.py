"""What a path costs and where it is blocked, by hand."""

import numpy as np
import pytest

from stack.costmap.route_costs import blocked_at, route_cost
from stack.geometry.costs_under import costs_under
from stack.types import INSCRIBED_COST, LETHAL_COST, UNKNOWN_COST, CostGrid, Pose2D

AWAY = Pose2D(0.0, 50.0)


def floor(cost=0):
    """2 m by 1 m from (-1, -0.5) on, in cells of 10 cm."""
    return CostGrid(np.full((10, 20), cost, np.uint8), 0.1, (-1.0, -0.5))


def line(*xs, y=0.05):
    return np.array([(x, y) for x in xs])


def test_costs_are_those_of_the_cells_and_unknown_off_the_grid():
    costs = floor()
    costs.cells[5, 3], costs.cells[9, 19], costs.cells[0, 0] = 10, 20, 30
    points = np.array([(-0.65, 0.05), (0.95, 0.45), (-0.95, -0.45), (-0.55, 0.05),
                       (1.05, 0.45), (-1.05, -0.45), (0.95, 0.55), (-0.95, -0.55)])  # fmt: skip
    unknown = [UNKNOWN_COST] * 4
    assert list(costs_under(costs, points)) == [10, 20, 30, 0, *unknown]


@pytest.mark.parametrize(("cost", "per_metre"), [(0, 1.0), (126, 2.5), (252, 4.0), (255, 1.0)])
def test_a_metre_counts_up_to_four_times_by_its_cost(cost, per_metre):
    """1 + 3 c / 252; the unknown costs no more than its length."""
    assert route_cost(floor(cost), line(-0.95, -0.45, 0.05)) == pytest.approx(per_metre)


def test_each_step_counts_by_the_cell_that_it_leads_to():
    costs = floor()
    costs.cells[5, 10] = 252  # x from 0 to 0.1
    assert route_cost(costs, line(-0.35, 0.05, 0.25)) == pytest.approx(4.0 * 0.4 + 0.2)


@pytest.mark.parametrize(
    ("cost", "blocked"),
    [(252, False), (INSCRIBED_COST, True), (LETHAL_COST, True), (UNKNOWN_COST, False)],
)
def test_a_path_is_blocked_where_the_base_would_collide(cost, blocked):
    costs = floor()
    costs.cells[5, 10:12] = cost
    found = blocked_at(costs, line(-0.95, -0.05, 0.05, 0.15, 0.95), AWAY, 0.3)
    assert found == ((0.05, 0.05) if blocked else None)


def test_what_is_near_the_robot_does_not_block_its_path():
    costs = floor()
    costs.cells[5, 10:12] = LETHAL_COST
    path = line(-0.95, 0.05, 0.15, 0.95)
    assert blocked_at(costs, path, Pose2D(-0.2, 0.05), 0.3) == (0.15, 0.05)
    assert blocked_at(costs, path, Pose2D(-0.2, 0.05), 0.4) is None


def test_what_lies_on_the_path_itself_may_be_asked_for_alone():
    costs = floor()
    costs.cells[5, 5], costs.cells[5, 15] = INSCRIBED_COST, LETHAL_COST
    found = blocked_at(costs, line(-0.95, -0.45, 0.55), AWAY, 0.0, LETHAL_COST)
    assert found == (0.55, 0.05)
