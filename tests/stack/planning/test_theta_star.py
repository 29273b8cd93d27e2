"""Theta* against Dijkstra's algorithm on the same cells, and its lines against dense sampling."""

import heapq
from dataclasses import replace
from itertools import pairwise
from math import hypot, inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import NavigationError
from stack.planning.smoothers.choice import SMOOTHERS
from stack.planning.theta_star import kernels
from stack.planning.theta_star.planner import ThetaStar, ThetaStarParameters
from stack.types import (
    INSCRIBED_COST,
    LETHAL_COST,
    CostGrid,
    FailureCode,
    Pose2D,
)
from tests.stack.planning.office_maps import office_costs
from tests.stack.planning.test_astar import ROBOT, cost_arrays

EXACT = ThetaStarParameters(tolerance=0.0)
WEIGHTS = ThetaStar(EXACT, ROBOT)._weights


def dijkstra(cells, start):
    """Cheapest cost over steps between cell centres, half a step in each of the two cells."""
    rows, columns = cells.shape
    cheapest, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        so_far, (row, column) = heapq.heappop(queue)
        if so_far > cheapest[row, column]:
            continue
        for rise in (-1, 0, 1):
            for run in (-1, 0, 1):
                near = row + rise, column + run
                if not (0 <= near[0] < rows and 0 <= near[1] < columns and (rise or run)):
                    continue
                through = [cells[near], cells[row, near[1]], cells[near[0], column]]
                if any(WEIGHTS[cost] == 0.0 for cost in through):
                    continue
                step = 0.5 * (WEIGHTS[cells[row, column]] + WEIGHTS[cells[near]])
                cost = so_far + step * hypot(rise, run)
                if cost < cheapest.get(near, inf):
                    cheapest[near] = cost
                    heapq.heappush(queue, (cost, near))
    return cheapest


def search(cells, start, goal):
    """(found, cost so far by cell, corner cells from start to goal)."""
    columns = cells.shape[1]
    so_far = np.full(cells.size, kernels.NOT_REACHED)
    parents, closed = np.empty(cells.size, np.int32), np.zeros(cells.size, np.bool_)
    ends = [row * columns + column for row, column in (start, goal)]
    status, _ = kernels.search(
        cells, WEIGHTS, 1.0, so_far, parents, closed, *ends, 10**9, np.zeros(1, np.uint8)
    )
    found = status == kernels.FOUND
    corners = [ends[1]]
    while found and parents[corners[-1]] != corners[-1]:
        corners.append(int(parents[corners[-1]]))
    return found, so_far[ends[1]], [divmod(cell, columns) for cell in reversed(corners)]


@given(cost_arrays(), st.data())
@settings(deadline=None, max_examples=200)
def test_reachable_means_found_and_no_more_expensive_than_any_path_of_steps(cells, data):
    passable = [tuple(cell) for cell in np.argwhere(WEIGHTS[cells] > 0.0).tolist()]
    if not passable:
        return
    start, goal = data.draw(st.sampled_from(passable)), data.draw(st.sampled_from(passable))
    optimum = dijkstra(cells, start)
    found, cost, corners = search(cells, start, goal)
    assert found == (goal in optimum)
    if not found:
        return
    assert cost <= optimum[goal] + 1e-9
    lines = [
        kernels.line_cost(cells, WEIGHTS, *one, *other, np.inf) for one, other in pairwise(corners)
    ]
    assert corners[0] == start and sum(lines) == pytest.approx(cost, abs=1e-9)


@pytest.mark.parametrize("weight", [0.2, 3.0, 50.0])
def test_the_queue_of_buckets_pops_in_the_order_of_a_heap_of_all_cells(weight):
    """Costs of all cells as by a plain heap; the weight sets how many buckets a step may skip."""
    parameters = replace(EXACT, traversal_weight=weight)
    weights = ThetaStar(parameters, ROBOT)._weights
    random = np.random.default_rng(7)
    cells = (random.integers(0, 253, (60, 70)) * (random.random((60, 70)) < 0.4)).astype(np.uint8)
    cells[random.random((60, 70)) < 0.15] = LETHAL_COST
    cells[2, 3] = cells[55, 66] = 0
    ends = 2 * 70 + 3, 55 * 70 + 66
    so_far = np.full(cells.size, kernels.NOT_REACHED)
    parents, closed = np.empty(cells.size, np.int32), np.zeros(cells.size, np.bool_)
    status, expanded = kernels.search(
        cells, weights, weights[0], so_far, parents, closed, *ends, 10**9, np.zeros(1, np.uint8)
    )
    assert status == kernels.FOUND
    expected, order = plain_search(cells, weights, *ends)
    assert expanded == len(order) and set(np.flatnonzero(closed)) == set(order)
    assert np.array_equal(so_far[order], [expected[cell] for cell in order])


def steps_from(cells, weights, row, column):
    """(index, cost of the step) of the neighbours that can be entered."""
    rows, columns = cells.shape
    for rise, run in ((r, c) for r in (-1, 0, 1) for c in (-1, 0, 1) if r or c):
        near_row, near_column = row + rise, column + run
        if not (0 <= near_row < rows and 0 <= near_column < columns):
            continue
        crossed = cells[near_row, near_column], cells[row, near_column], cells[near_row, column]
        if all(weights[cost] > 0.0 for cost in crossed):
            both = weights[cells[row, column]] + weights[cells[near_row, near_column]]
            yield near_row * columns + near_column, 0.5 * hypot(rise, run) * both


def plain_search(cells, weights, start, goal):
    """(costs by cell, cells in the order of expansion) of Lazy Theta* with one heap."""
    columns = cells.shape[1]

    def to_go(cell):
        rise, run = cell // columns - goal // columns, cell % columns - goal % columns
        return weights[0] * (rise * rise + run * run) ** 0.5

    costs, parents, order, closed = {start: 0.0}, {start: start}, [], set()
    queue = [(to_go(start), start)]
    while queue:
        _, cell = heapq.heappop(queue)
        if cell in closed:
            continue
        grand = parents[parents[cell]]
        if grand != parents[cell]:
            line = kernels.line_cost(
                cells, weights, *divmod(grand, columns), *divmod(cell, columns),
                costs[cell] - costs[grand],
            )  # fmt: skip
            if costs[grand] + line <= costs[cell]:
                costs[cell], parents[cell] = costs[grand] + line, grand
        closed.add(cell)
        order.append(cell)
        if cell == goal:
            break
        for near, step in steps_from(cells, weights, *divmod(cell, columns)):
            cost = costs[cell] + step
            if near not in closed and cost < costs.get(near, inf):
                costs[near], parents[near] = cost, cell
                heapq.heappush(queue, (cost + to_go(near), near))
    return costs, order


def test_a_line_counts_each_cell_by_the_length_in_it():
    random = np.random.default_rng(3)
    cells = random.integers(0, 200, (30, 40)).astype(np.uint8)
    share = (np.arange(100_000) + 0.5) / 100_000
    for _ in range(40):
        row, end_row = (int(value) for value in random.integers(0, 30, 2))
        column, end_column = (int(value) for value in random.integers(0, 40, 2))
        rows = np.floor(row + 0.5 + share * (end_row - row)).astype(int)
        columns = np.floor(column + 0.5 + share * (end_column - column)).astype(int)
        length = hypot(end_row - row, end_column - column)
        sampled = WEIGHTS[cells[rows, columns]].mean() * length
        exact = kernels.line_cost(cells, WEIGHTS, row, column, end_row, end_column, np.inf)
        assert exact == pytest.approx(sampled, abs=2e-3)


def test_a_line_does_not_pass_between_two_cells_that_touch_at_a_corner():
    cells = np.zeros((3, 3), dtype=np.uint8)
    cells[0, 1] = LETHAL_COST
    assert kernels.line_cost(cells, WEIGHTS, 0, 0, 2, 2, np.inf) == np.inf
    assert kernels.line_cost(cells, WEIGHTS, 1, 0, 2, 1, np.inf) == pytest.approx(2**0.5)


def test_over_open_floor_it_goes_straight_at_any_angle():
    cells = np.zeros((60, 60), dtype=np.uint8)
    found, cost, corners = search(cells, (3, 4), (50, 27))
    assert found and corners == [(3, 4), (50, 27)]
    assert cost == pytest.approx(hypot(47, 23))  # 8-connected: 47 + 23 (√2 - 1) = 56.5, not 52.3


def test_round_a_block_it_touches_the_corner():
    cells = np.zeros((40, 40), dtype=np.uint8)
    cells[:20, 18:22] = LETHAL_COST
    found, cost, corners = search(cells, (5, 5), (5, 35))
    # past the block's upper corners, whose nearest passable middles are (20, 17) and (20, 22)
    shortest = hypot(15, 12) + 5 + hypot(15, 13)
    assert found and cost == pytest.approx(shortest, rel=0.01)
    assert len(corners) <= 5


@pytest.mark.parametrize("smoother", SMOOTHERS)
def test_plans_in_an_office_touch_nothing_and_join_start_and_goal(smoother):
    grid = office_costs(260, 5)
    planner = ThetaStar(replace(EXACT, smoother=smoother), ROBOT)
    random = np.random.default_rng(5)
    passable, planned = np.argwhere(grid.cells < INSCRIBED_COST), 0
    for _ in range(10):
        start, goal = (
            Pose2D(*grid.centre_of(*passable[n]), 0.3) for n in random.integers(0, len(passable), 2)
        )
        try:
            points = planner.plan(grid, start, goal).points
        except NavigationError as error:
            assert error.failure.code == FailureCode.NO_VALID_PATH
            continue
        planned += 1
        assert tuple(points[-1]) == (goal.x, goal.y, goal.heading)
        assert max(grid.cells[grid.cell_at(x, y)] for x, y, _ in points) < INSCRIBED_COST
        again = ThetaStar(replace(EXACT, smoother=smoother), ROBOT).plan(grid, start, goal)
        assert np.array_equal(points, again.points)
    assert planned >= 7


def split_floor():
    """5 m × 5 m, a wall without a door at y = 2.5; inscribed cells on both sides of it."""
    cells = np.zeros((100, 100), dtype=np.uint8)
    cells[46:54] = INSCRIBED_COST
    cells[49:51] = LETHAL_COST
    return CostGrid(cells, 0.05)


def test_no_path_leads_behind_a_wall_but_a_partial_plan_ends_at_it():
    start, goal = Pose2D(1.0, 1.0), Pose2D(1.0, 4.0)
    with pytest.raises(NavigationError, match=r"the nearest reachable place is \(0.98, 2.27") as no:
        ThetaStar(EXACT, ROBOT).plan(split_floor(), start, goal)
    assert no.value.failure.place == pytest.approx((0.975, 2.275))
    path = ThetaStar(replace(EXACT, allow_partial=True), ROBOT).plan(split_floor(), start, goal)
    assert path.goal.y == pytest.approx(2.275)  # row 45, the last below the inscribed ones


def test_an_occupied_start_is_left_on_its_own_side_of_the_wall():
    planner = ThetaStar(replace(EXACT, escape_distance=0.6), ROBOT)
    grid = split_floor()
    grid.cells[46:54, 80:] = 0  # a gap at x = 4
    start, goal = Pose2D(2.0, 2.42), Pose2D(2.0, 2.9)
    points = planner.plan(grid, start, goal).points
    assert points[:, 0].max() > 3.9
    inside = [grid.cells[grid.cell_at(x, y)] for x, y, _ in points]
    assert max(inside) == INSCRIBED_COST and inside[10:].count(INSCRIBED_COST) == 0
