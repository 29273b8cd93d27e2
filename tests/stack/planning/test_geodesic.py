"""Descent of the cost integral: geodesics with a known form, and that no path becomes dearer."""

import numpy as np
import pytest

from stack.errors import NavigationError
from stack.planning.astar import Astar, AstarParameters
from stack.planning.geodesic import kernels
from stack.planning.search import StepCosts
from stack.planning.smoothing import resampled
from stack.streams import stream
from stack.types import INSCRIBED_COST, Pose2D
from tests.benchmarks.planning import ROBOT
from tests.stack.planning.office_maps import office_costs

TRAVERSE = StepCosts.of(3.0, True).traverse


def queries(side, seed, count):
    """(costs, start, goal) between random passable cells of an office that have a path."""
    costs, random = office_costs(side, seed), stream(seed, "geodesic")
    ways, planner = np.argwhere(costs.cells < INSCRIBED_COST), Astar(AstarParameters(), ROBOT)
    found = []
    while len(found) < count:
        start, goal = (
            Pose2D(*costs.centre_of(*ways[n])) for n in random.integers(len(ways), size=2)
        )
        try:
            planner.plan(costs, start, goal)
        except NavigationError:
            continue
        found.append((costs, start, goal))
    return found


def cost(costs, poses):
    """Integral of step cost along poses, in step costs times cells."""
    points = (poses[:, :2] - np.array(costs.origin)) / costs.resolution
    return kernels.path_cost(costs.cells, TRAVERSE, np.ascontiguousarray(points))


def test_the_cost_of_a_line_is_its_length_times_the_step_cost():
    cells = np.zeros((20, 40), dtype=np.uint8)
    cells[:, 20:] = 252  # step cost 100 * (1 + 3) there, 100 elsewhere
    line = np.array([[10.0, 10.5], [20.0, 10.5], [30.0, 10.5]])
    cost = kernels.path_cost(cells, TRAVERSE, line)
    assert cost == pytest.approx(10 * 100 + 10 * 400)  # interpolation is symmetric at the border


def test_over_open_floor_a_bow_becomes_straight():
    along = np.linspace(10.0, 30.0, 21)
    bow = np.column_stack([along, 20.0 + 2.0 * np.sin(np.pi * (along - 10.0) / 20.0)])
    flat = kernels.descend(np.zeros((40, 40), dtype=np.uint8), TRAVERSE, bow, 0.0, 500)
    assert np.abs(flat[:, 1] - 20.0).max() < 0.1  # from 2 cells
    assert flat[[0, -1]] == pytest.approx(bow[[0, -1]])


def test_a_line_moves_into_a_trough_of_cost():
    rows = np.abs(np.arange(41) - 20) * 6
    cells = np.repeat(rows[:, None], 81, axis=1).astype(np.uint8)  # cheapest at y = 20.5
    line = resampled(np.array([[2.5, 26.5], [78.5, 26.5]]), 2.0)
    moved = kernels.descend(cells, TRAVERSE, line, 300.0, 500)
    assert moved[19, 1] == pytest.approx(20.5, abs=0.5)
    before, after = (kernels.path_cost(cells, TRAVERSE, points) for points in (line, moved))
    assert after < before


def test_smoothed_paths_cost_less_than_the_cells_and_bend_gently():
    raw = Astar(AstarParameters(smoother="none"), ROBOT)
    smooth = Astar(AstarParameters(), ROBOT)
    shares, bends = [], []
    for seed in range(3):
        for costs, start, goal in queries(300, seed, 8):
            cells, path = (planner.plan(costs, start, goal).points for planner in (raw, smooth))
            shares.append(cost(costs, path) / cost(costs, cells))
            bends.append(np.abs(np.diff(np.unwrap(path[:-1, 2]))))
    assert max(shares) <= 1.01  # of the cells; sampling 5 cm apart cuts their corners by below 1 %
    assert np.mean(shares) < 1.0
    assert np.quantile(np.concatenate(bends), 0.99) < 0.11  # rad per 5 cm
