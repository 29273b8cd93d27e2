"""Every goal that a flood fill reaches gets a plan, and plans keep to the middle of corridors."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import choose
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.planning.smoothers.choice import SMOOTHERS
from stack.types import FREE, OCCUPIED, OccupancyGrid, Pose2D
from tests.stack.planning.test_robots_and_planners import ROUND as ROBOT

SIDE = 80
RADIUS = 0.22
MARGIN = {"astar": 0.0, "theta_star": 0.0, "hybrid_astar": 0.1, "lattice": 0.1}
"""Metres of clearance beyond a round robot's radius with which a plan never fails.

The pose planners use arcs and sixteen headings, which do not fit through the narrowest gaps. Of 120
random maps hybrid_astar fails in 8 % and the lattice in 4 % without extra clearance, in 1 % and in
none with 5 cm, and both in none with 10 cm.
"""


def planner(name, **values):
    choice = choose("planner", name, {"tolerance": 0.0, **values})
    return choice.component(choice.parameters, ROBOT)


def distances(cells):
    """Metres from each cell's centre to the nearest occupied one's, by brute force."""
    rows, columns = np.indices(cells.shape)
    squares = np.full(cells.shape, 10**9)
    for row, column in np.argwhere(cells == OCCUPIED):
        squares = np.minimum(squares, (rows - row) ** 2 + (columns - column) ** 2)
    return 0.05 * np.sqrt(squares)


def flooded(free, start):
    """Cells connected to a start by straight steps over free cells."""
    seen, waiting = np.zeros_like(free), [start]
    seen[start] = True
    while waiting:
        row, column = waiting.pop()
        for near in ((row + 1, column), (row - 1, column), (row, column + 1), (row, column - 1)):
            inside = 0 <= near[0] < SIDE and 0 <= near[1] < SIDE
            if inside and free[near] and not seen[near]:
                seen[near] = True
                waiting.append(near)
    return seen


@st.composite
def places(draw):
    """A walled map with boxes in it, and a random generator."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    cells = np.full((SIDE, SIDE), FREE, dtype=np.int8)
    cells[[0, -1]] = cells[:, [0, -1]] = OCCUPIED
    for _ in range(draw(st.integers(3, 40))):
        row, column = random.integers(0, SIDE, 2)
        height, width = random.integers(1, 14, 2)
        cells[row : row + height, column : column + width] = OCCUPIED
    return cells, random


@pytest.mark.parametrize("name", MARGIN)
@given(places())
@settings(deadline=None, max_examples=25)
def test_every_reachable_goal_gets_a_plan(name, place):
    cells, random = place
    free = distances(cells) > RADIUS + MARGIN[name]
    if not free.any():
        return
    passable = np.argwhere(free)
    start = tuple(int(number) for number in passable[random.integers(len(passable))])
    reachable = np.argwhere(flooded(free, start))
    goal = tuple(int(number) for number in reachable[random.integers(len(reachable))])
    grid = Costmap(CostmapParameters(), ROBOT.footprint, OccupancyGrid(cells, 0.05)).grid
    here, there = (
        Pose2D(*grid.centre_of(*cell), random.uniform(-np.pi, np.pi)) for cell in (start, goal)
    )
    path = planner(name).plan(grid, here, there)  # raises nothing
    assert path.points[-1] == pytest.approx([there.x, there.y, there.heading])
    assert not path.partial


def corridor(width):
    """8 m long, `width` cells wide, and its middle line's y."""
    cells = np.full((60, 160), OCCUPIED, dtype=np.int8)
    cells[10 : 10 + width, 2:-2] = FREE
    return cells, 0.05 * (10 + width / 2)


@pytest.mark.parametrize("width", [12, 20, 28])
@pytest.mark.parametrize("smoother", [name for name in SMOOTHERS if name != "none"])
@pytest.mark.parametrize("name", MARGIN)
def test_paths_keep_to_the_middle_of_corridors(name, smoother, width):
    """Mean clearance between the ends as a share of the largest possible: 85 %.

    The largest is half the width, or the inflation radius if that is less: beyond it a wall adds no
    cost. A path straight on from its start would have 60 % in a corridor 1 m wide, 55 % in one
    1.4 m wide.
    """
    cells, middle = corridor(width)
    grid = Costmap(CostmapParameters(), ROBOT.footprint, OccupancyGrid(cells, 0.05)).grid
    aside = max(0.0, 0.025 * width - 0.3)  # starts and ends nearer to one wall than to the other
    start, goal = Pose2D(0.8, middle + aside, 0.0), Pose2D(7.2, middle + aside, 0.0)
    points = planner(name, smoother=smoother).plan(grid, start, goal).points
    between = points[(points[:, 0] > 2.0) & (points[:, 0] < 6.0), 1]
    clearance = 0.025 * width - np.abs(between - middle)
    assert clearance.mean() >= 0.85 * min(0.025 * width, CostmapParameters().inflation_radius)
