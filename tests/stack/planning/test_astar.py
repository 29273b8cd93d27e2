"""A* against an independent Dijkstra search, and its error messages."""

import heapq
from dataclasses import replace
from math import hypot, inf
from pathlib import Path as FilePath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.differential import Wheels
from stack.errors import NavigationError
from stack.planning import kernels
from stack.planning.astar import Astar, AstarParameters
from stack.planning.search import StepCosts, Workspace
from stack.planning.smoothers.choice import SMOOTHERS
from stack.types import (
    FREE,
    INSCRIBED_COST,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN_COST,
    CostGrid,
    FailureCode,
    Footprint,
    OccupancyGrid,
    Pose2D,
    Scan,
)
from tests.stack.costmap.marks import seen
from tests.stack.planning.office_maps import office_costs

ROBOT = RobotDescription(
    "round", Footprint.circle(0.22), 0.4, FilePath("none.urdf"), Wheels((), (), 0.05, 0.3)
)
EXACT = AstarParameters(tolerance=0.0)
WEIGHT = AstarParameters().cost_weight


def is_way(cost):
    return cost < INSCRIBED_COST or cost == UNKNOWN_COST


def step_cost(cost):
    """The documented cost per cell of length: 1 + weight · c / 252, unknown cells as c = 126."""
    return 1.0 + WEIGHT * (126 if cost == UNKNOWN_COST else cost) / 252


def neighbours(costs, cell):
    rows, columns = costs.shape
    row, column = cell
    for rise in (-1, 0, 1):
        for run in (-1, 0, 1):
            near = row + rise, column + run
            if (rise or run) and 0 <= near[0] < rows and 0 <= near[1] < columns:
                sides = costs[row, near[1]], costs[near[0], column]
                if is_way(costs[near]) and (not (rise and run) or all(map(is_way, sides))):
                    yield near, hypot(rise, run) * step_cost(int(costs[near]))


def dijkstra(costs, start):
    """Cheapest cost from start to every reachable cell, in floating point."""
    cheapest, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        so_far, cell = heapq.heappop(queue)
        if so_far > cheapest[cell]:
            continue
        for near, cost in neighbours(costs, cell):
            if so_far + cost < cheapest.get(near, inf):
                cheapest[near] = so_far + cost
                heapq.heappush(queue, (so_far + cost, near))
    return cheapest


def cost_of(costs, cells):
    """Cost of a list of cells; fails where a step is not allowed."""
    return sum(
        dict(neighbours(costs, tuple(one)))[tuple(other)]
        for one, other in zip(cells[:-1].tolist(), cells[1:].tolist(), strict=True)
    )


@st.composite
def cost_arrays(draw):
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    shape = draw(st.integers(1, 24)), draw(st.integers(1, 24))
    costs = random.integers(0, 253, shape).astype(np.uint8)
    costs[random.random(shape) < draw(st.sampled_from([0.0, 0.5, 0.9]))] = 0
    blocked = random.random(shape) < draw(st.sampled_from([0.0, 0.2, 0.4, 0.6]))
    costs[blocked] = random.choice([INSCRIBED_COST, LETHAL_COST], np.count_nonzero(blocked))
    costs[random.random(shape) < 0.05] = UNKNOWN_COST
    return costs


def two_cells(costs, data):
    passable = [
        tuple(cell) for cell in np.argwhere((costs < INSCRIBED_COST) | (costs == 255)).tolist()
    ]
    if not passable:
        return None
    return data.draw(st.sampled_from(passable)), data.draw(st.sampled_from(passable))


@pytest.mark.pain("n4655", "o18")
@given(cost_arrays(), st.data())
@settings(deadline=None, max_examples=300)
def test_every_reachable_goal_is_found_at_the_least_cost(costs, data):
    chosen = two_cells(costs, data)
    if chosen is None:
        return
    start, goal = chosen
    columns = costs.shape[1]
    numbers = [row * columns + column for row, column in chosen]
    workspace = Workspace(*costs.shape, StepCosts.of(WEIGHT, True))
    for _ in range(2):  # the second time in used arrays
        found = workspace.run(CostGrid(costs, 0.05), *numbers, 0)
        optimum = dijkstra(costs, start)
        assert found == (goal in optimum)
        if found:
            cells = kernels.extract(workspace.parents, columns, *numbers)
            assert tuple(cells[0]) == start and tuple(cells[-1]) == goal
            assert cost_of(costs, cells) <= 1.01 * optimum[goal] + 1e-9


@given(cost_arrays(), st.data(), st.sampled_from(SMOOTHERS))
@settings(deadline=None, max_examples=150)
def test_plans_are_collision_free_and_connect_start_and_goal(costs, data, smoother):
    chosen = two_cells(costs, data)
    if chosen is None:
        return
    grid = CostGrid(costs, 0.05, (-3.0, 4.0))
    start, goal = (Pose2D(*grid.centre_of(*cell), 0.7) for cell in chosen)
    planner = Astar(replace(EXACT, smoother=smoother), ROBOT)
    if chosen[1] not in dijkstra(costs, chosen[0]):
        with pytest.raises(NavigationError, match="NO_VALID_PATH"):
            planner.plan(grid, start, goal)
        return
    points = planner.plan(grid, start, goal).points
    assert tuple(points[0, :2]) == (start.x, start.y)
    assert tuple(points[-1]) == (goal.x, goal.y, goal.heading)
    for x, y, _ in points:
        assert is_way(costs[grid.cell_at(x, y)])


@pytest.mark.pain("n4655", "o18")
def test_no_plan_fails_in_two_hundred_offices():
    planner = Astar(EXACT, ROBOT)
    lengths = []
    for seed in range(200):
        grid = office_costs(260, seed)
        random = np.random.default_rng(seed)
        passable = np.argwhere(grid.cells < INSCRIBED_COST)
        start, goal = (tuple(passable[index]) for index in random.integers(0, len(passable), 2))
        here, there = (Pose2D(*grid.centre_of(*cell)) for cell in (start, goal))
        try:
            path = planner.plan(grid, here, there)
        except NavigationError:
            assert not connected(grid.cells, start, goal)
            continue
        lengths.append(path.length)
        inside = grid.cells[tuple(np.array([grid.cell_at(x, y) for x, y, _ in path.points]).T)]
        assert inside.max() < INSCRIBED_COST
        assert path.length >= 0.999 * here.distance_to(there)
    assert len(lengths) > 150


def connected(costs, start, goal):
    """Whether two cells are connected by straight steps, by flood fill on whole arrays."""
    free = costs < INSCRIBED_COST
    reached = np.zeros_like(free)
    reached[start] = True
    while True:
        grown = reached.copy()
        grown[1:] |= reached[:-1]
        grown[:-1] |= reached[1:]
        grown[:, 1:] |= reached[:, :-1]
        grown[:, :-1] |= reached[:, 1:]
        grown &= free
        if np.array_equal(grown, reached):
            return bool(reached[goal])
        reached = grown


def two_rooms(doors=((30, 48), (150, 168))):
    """10 m × 5 m, a wall across the middle with doors (columns from, to)."""
    cells = np.full((100, 200), FREE, dtype=np.int8)
    cells[[0, -1]] = cells[49:51] = OCCUPIED
    cells[:, [0, -1]] = OCCUPIED
    for begin, end in doors:
        cells[49:51, begin:end] = FREE
    return OccupancyGrid(cells, 0.05)


def costs_of(grid):
    return Costmap(CostmapParameters(), ROBOT.footprint, grid).grid


def test_a_door_that_closes_sends_the_plan_through_the_other_one():
    costmap = Costmap(CostmapParameters(), ROBOT.footprint, two_rooms())
    planner = Astar(AstarParameters(), ROBOT)
    start, goal = Pose2D(2.0, 1.5), Pose2D(2.0, 4.0)
    assert planner.plan(costmap.grid, start, goal).points[:, 0].max() < 2.5
    # standing 1 m below the first door, the lidar sees a slab in it at y = 2.475
    angles = np.linspace(np.pi / 4, 3 * np.pi / 4, 90)
    ranges = (0.975 / np.sin(angles)).astype(np.float32)
    scan = Scan(0.0, ranges, float(angles[0]), float(angles[1] - angles[0]), 0.08, 12.0)
    costmap.update(seen(Pose2D(1.95, 1.5), scan, 0.0))
    detour = planner.plan(costmap.grid, start, goal)
    assert detour.points[:, 0].max() > 7.5
    costmap.clear()
    assert planner.plan(costmap.grid, start, goal).points[:, 0].max() < 2.5


@pytest.mark.pain("n4808", "n6100")
def test_paths_keep_to_the_middle_of_a_corridor_and_of_doors():
    cells = np.full((30, 200), FREE, dtype=np.int8)
    cells[:5] = cells[25:] = OCCUPIED  # 1 m wide, middle at y = 0.75
    planner = Astar(AstarParameters(), ROBOT)
    path = planner.plan(costs_of(OccupancyGrid(cells, 0.05)), Pose2D(1.0, 0.6), Pose2D(9.0, 0.9))
    middle = path.points[20:-20, 1]
    assert np.abs(middle - 0.75).max() < 0.06
    path = planner.plan(costs_of(two_rooms()), Pose2D(1.0, 1.0), Pose2D(1.0, 4.0))
    crossing = path.points[np.abs(path.points[:, 1] - 2.5).argmin()]
    assert crossing[0] == pytest.approx(1.95, abs=0.11)  # 0.9 m door, middle at x = 1.95


def test_headings_follow_the_path_and_end_at_the_goal_heading():
    planner = Astar(AstarParameters(), ROBOT)
    costs = CostGrid(np.zeros((100, 100), dtype=np.uint8), 0.05)
    points = planner.plan(costs, Pose2D(1.0, 1.0, 3.0), Pose2D(3.0, 3.0, -2.0)).points
    assert points[:-1, 2] == pytest.approx(np.pi / 4, abs=1e-6)
    assert points[-1, 2] == -2.0


def test_start_and_goal_in_one_cell_give_two_poses():
    planner = Astar(AstarParameters(), ROBOT)
    costs = CostGrid(np.zeros((10, 10), dtype=np.uint8), 0.05)
    path = planner.plan(costs, Pose2D(0.21, 0.21, 1.0), Pose2D(0.24, 0.21, 2.0))
    assert path.points == pytest.approx(np.array([[0.21, 0.21, 0.0], [0.24, 0.21, 2.0]]))


def test_a_start_too_close_to_a_wall_is_left_by_the_shortest_path():
    costs = costs_of(two_rooms())
    start = Pose2D(5.0, 2.30)  # the wall begins at y = 2.45: inscribed
    assert costs.cells[costs.cell_at(5.0, 2.30)] == INSCRIBED_COST
    points = Astar(AstarParameters(), ROBOT).plan(costs, start, Pose2D(8.0, 1.0)).points
    inside = [costs.cells[costs.cell_at(x, y)] for x, y, _ in points]
    assert max(inside) == INSCRIBED_COST
    blocked = [index for index, cost in enumerate(inside) if cost == INSCRIBED_COST]
    assert blocked == list(range(len(blocked))) and len(blocked) <= 6


def test_an_occupied_start_does_not_lead_through_the_adjacent_wall():
    costs = costs_of(two_rooms(doors=((150, 168),)))
    start, goal = Pose2D(2.0, 2.40), Pose2D(2.0, 2.85)  # on both sides of a wall of 0.1 m
    points = Astar(replace(EXACT, escape_distance=0.6), ROBOT).plan(costs, start, goal).points
    assert max(costs.cells[costs.cell_at(x, y)] for x, y, _ in points) < LETHAL_COST
    assert points[:, 0].max() > 7.5  # through the door


def test_a_start_in_an_occupied_cell_is_left_if_free_space_is_close():
    costs = costs_of(two_rooms())
    costs.cells[costs.cell_at(2.0, 1.0)] = LETHAL_COST
    path = Astar(AstarParameters(), ROBOT).plan(costs, Pose2D(2.0, 1.0), Pose2D(8.0, 1.0))
    assert path.length == pytest.approx(6.0, abs=0.1)


def test_a_blocked_goal_moves_to_the_nearest_place_within_the_tolerance():
    costs = costs_of(two_rooms())
    goal = Pose2D(5.0, 2.30, 1.0)
    path = Astar(AstarParameters(tolerance=0.2), ROBOT).plan(costs, Pose2D(2.0, 1.0), goal)
    # free begins 5 cells below the wall's lowest row, 49: row 44, middle y = 2.225
    assert path.goal.y == pytest.approx(2.225)
    assert path.goal.distance_to(goal) < 0.1 and path.goal.heading == 1.0


def test_within_the_tolerance_the_nearest_reachable_place_is_used():
    grid = two_rooms(doors=())
    grid.cells[49:51, 100] = FREE  # a slit much too narrow
    goal = Pose2D(5.0, 2.76)  # just above the wall, nearest free ground is above as well
    start = Pose2D(2.0, 1.0)
    path = Astar(AstarParameters(tolerance=0.6), ROBOT).plan(costs_of(grid), start, goal)
    assert path.goal.y == pytest.approx(2.225)
    with pytest.raises(NavigationError, match="NO_VALID_PATH"):
        Astar(AstarParameters(tolerance=0.4), ROBOT).plan(costs_of(grid), start, goal)


def test_unknown_cells_are_crossed_only_if_allowed():
    costs = CostGrid(np.zeros((40, 100), dtype=np.uint8), 0.05)
    costs.cells[:, 50:60] = UNKNOWN_COST
    start, goal = Pose2D(1.0, 1.0), Pose2D(4.0, 1.0)
    assert Astar(EXACT, ROBOT).plan(costs, start, goal).length == pytest.approx(3.0, rel=1e-3)
    with pytest.raises(NavigationError, match="NO_VALID_PATH"):
        Astar(replace(EXACT, allow_unknown=False), ROBOT).plan(costs, start, goal)


INSIDE = Pose2D(2.0, 1.0)
FAILURES = [
    (Pose2D(-1.0, 1.0), INSIDE, FailureCode.START_OUTSIDE_MAP,
     "start (-1.00, 1.00) is outside the map, which covers x 0.00 to 10.00 m and y 0.00 to 5.00"),
    (INSIDE, Pose2D(3.0, 5.01), FailureCode.GOAL_OUTSIDE_MAP,
     "goal (3.00, 5.01) is outside the map"),
    (Pose2D(6.0, 0.02), INSIDE, FailureCode.START_OCCUPIED,
     "start (6.00, 0.02) is in an occupied cell and no cell within 0.30 m is free; "
     "the nearest free place is (5.98, 0.43)"),
    (INSIDE, Pose2D(6.01, 0.02), FailureCode.GOAL_OCCUPIED,
     "goal (6.01, 0.02) is in an occupied cell; the nearest free place is (6.03, 0.43)"),
    (INSIDE, Pose2D(6.01, 0.22), FailureCode.GOAL_OCCUPIED,
     "goal (6.01, 0.22) is too close to an obstacle; the nearest free place is (6.03, 0.43)"),
    (INSIDE, Pose2D(2.0, 4.0), FailureCode.NO_VALID_PATH,
     "no path from (2.00, 1.00) to (2.00, 4.00): the nearest reachable place is "
     "(1.98, 2.23), 1.78 m from the goal"),
]  # fmt: skip


@pytest.mark.parametrize(("start", "goal", "code", "sentence"), FAILURES)
def test_failures_name_the_pose_and_the_nearest_free_place(start, goal, code, sentence):
    grid = two_rooms(doors=())
    grid.cells[:4] = OCCUPIED  # thick: free ground begins 5 cells further, in row 8: y = 0.425
    with pytest.raises(NavigationError) as caught:
        Astar(EXACT, ROBOT).plan(costs_of(grid), start, goal)
    assert caught.value.failure.code == code
    assert sentence in caught.value.failure.sentence


def test_an_enclosed_start_has_no_valid_path():
    costs = CostGrid(np.full((60, 60), INSCRIBED_COST, dtype=np.uint8), 0.05)
    costs.cells[:5] = 0
    with pytest.raises(NavigationError, match=r"NO_VALID_PATH: start \(1\.50, 1\.50\) is enclosed"):
        Astar(EXACT, ROBOT).plan(costs, Pose2D(1.5, 1.5), Pose2D(1.0, 0.1))


def test_a_maze_longer_than_the_first_range_and_queue_is_solved():
    # walls in every other row, gaps at alternating ends, so that costs overrun a small limit
    cells = np.zeros((201, 60), dtype=np.uint8)
    cells[1::2] = LETHAL_COST
    cells[1::4, -1] = cells[3::4, 0] = 0
    workspace = Workspace(201, 60, StepCosts.of(WEIGHT, True))
    workspace.highest = 50_000
    assert workspace.run(CostGrid(cells, 0.05), 0, 200 * 60, 0)
    assert workspace.reached.dtype == np.int64
    path = kernels.extract(workspace.parents, 60, 0, 200 * 60)
    assert len(path) == 100 * 60 + 100 + 1  # hundred rows, the gaps between them, the goal


def test_a_path_of_more_than_the_expected_cost_is_found_in_a_second_search():
    # 100 rows of 500 cells: at least 50 000 steps of 100 to a goal 200 cells away
    cells = np.zeros((201, 500), dtype=np.uint8)
    cells[1::2] = LETHAL_COST
    cells[1::4, -1] = cells[3::4, 0] = 0
    workspace = Workspace(201, 500, StepCosts.of(WEIGHT, True))
    assert workspace.run(CostGrid(cells, 0.05), 0, 200 * 500, 0)
    assert workspace.reached.dtype == np.int32
    assert workspace.limit == workspace.highest > 5_000_000
    assert len(kernels.extract(workspace.parents, 500, 0, 200 * 500)) == 100 * 500 + 100 + 1


def test_queries_on_a_large_map_use_the_range_of_their_distance():
    """Clearing the cells takes time with the area; 32 bits of range last for many queries."""
    costs = CostGrid(np.zeros((4000, 20), dtype=np.uint8), 0.05)
    workspace = Workspace(4000, 20, StepCosts.of(WEIGHT, True))
    before = workspace.base
    assert workspace.run(costs, 0, 399, 0)
    used = before - workspace.base
    assert (2**32 - 1) // used > 1000  # 19 + 19 + 512 steps, 64 times a free step of 100 each
    assert (2**32 - 1) // workspace.highest < 40


def test_work_arrays_are_reset_when_their_range_is_exhausted():
    costs = CostGrid(np.zeros((20, 20), dtype=np.uint8), 0.05)
    workspace = Workspace(20, 20, StepCosts.of(WEIGHT, True))
    workspace.run(costs, 0, 399, 0)
    used = workspace.limit + 1
    workspace.base = int(np.iinfo(np.int32).min) + 3 * used  # the range holds three more queries
    for _ in range(5):
        assert workspace.run(costs, 0, 399, 0)
        assert len(kernels.extract(workspace.parents, 20, 0, 399)) == 20
    assert workspace.base == int(np.iinfo(np.int32).max) - 2 * used


def test_cheap_unknown_cells_are_crossed_and_expensive_ones_avoided():
    """Straight over 1 m of unknown cells, or a detour of 2 x 0.3 m around them over free cells."""
    cells = np.zeros((60, 60), dtype=np.uint8)
    cells[10:50, 20:40] = UNKNOWN_COST
    costs = CostGrid(cells, 0.05)
    start, goal = Pose2D(0.3, 0.8), Pose2D(2.7, 0.8)

    def ground_crossed(unknown_as):
        raw = replace(EXACT, unknown_as=unknown_as, smoother="none")
        path = Astar(raw, ROBOT).plan(costs, start, goal)
        return sum(cells[costs.cell_at(x, y)] == UNKNOWN_COST for x, y in path.points[:, :2])

    assert ground_crossed(0.0) == pytest.approx(20, abs=1)  # 1 m of points 5 cm apart
    assert ground_crossed(126.0) <= 1  # 1 m would count as 2.5 m, the bow is 0.6 m longer
