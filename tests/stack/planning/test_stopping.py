"""Cancelled plans, limits of expansions, and partial plans, of every planner."""

from itertools import product
from pathlib import Path as FilePath
from threading import Event

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import CancelToken, Planner, PlanOptions, choose
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.differential import Wheels
from stack.errors import NavigationError
from stack.navigation.plans.planner_worker import PlannerWorker, PlanRequest
from stack.patience import Patience
from stack.planning import kernels
from stack.planning.search import ExpansionLimits, StepCosts, Workspace
from stack.types import (
    FREE,
    INSCRIBED_COST,
    OCCUPIED,
    CostGrid,
    Failure,
    FailureCode,
    Footprint,
    OccupancyGrid,
    Pose2D,
)

ROBOT = RobotDescription(
    "round", Footprint.circle(0.22), 0.4, FilePath("none.urdf"), Wheels((), (), 0.05, 0.3)
)
PLANNERS = ("astar", "theta_star", "hybrid_astar", "lattice")
START, GOAL = Pose2D(1.0, 1.0, 0.0), Pose2D(19.0, 19.0, 0.0)


def planner(name, **values):
    choice = choose("planner", name, values)
    return choice.component(choice.parameters, ROBOT)


def plan_failure(made, costs, start, goal, options):
    with pytest.raises(NavigationError) as caught:
        made.plan(costs, start, goal, options)
    return caught.value.failure


def open_floor(side=400):
    return CostGrid(np.zeros((side, side), dtype=np.uint8), 0.05)


@pytest.mark.parametrize("name", PLANNERS)
def test_a_cancelled_plan_fails_and_does_not_affect_the_next(name):
    made, cancel = planner(name), CancelToken()
    fresh = planner(name).plan(open_floor(), START, GOAL)
    cancel.request()
    failure = plan_failure(made, open_floor(), START, GOAL, PlanOptions(cancel=cancel))
    assert failure.code == FailureCode.CANCELLED
    assert np.array_equal(made.plan(open_floor(), START, GOAL).points, fresh.points)


@pytest.mark.parametrize("name", PLANNERS)
def test_the_limit_of_expansions_is_a_failure_that_quotes_it(name):
    grid = open_floor()
    grid.cells[50:, 190:210] = INSCRIBED_COST  # a detour, so that no straight line is free
    grid.cells[:50, 190:210] = 200
    made = planner(name, max_expansions=25, tolerance=0.0)
    failure = plan_failure(made, grid, START, GOAL, PlanOptions())
    assert failure.code == FailureCode.TIMED_OUT
    assert "no path from (1.00, 1.00) to (19.00, 19.00) found within 25 expansions" in (
        failure.sentence
    )
    again = planner(name, max_expansions=25, tolerance=0.0)
    assert plan_failure(again, grid, START, GOAL, PlanOptions()) == failure


def test_the_search_checks_the_cancel_flag_every_1024_expansions():
    class Wishing(CancelToken):
        """A flag that is set from the start, as by another thread."""

    cancel, grid = Wishing(), open_floor()
    cancel.request()
    workspace = Workspace(400, 400, StepCosts.of(3.0, True))
    with pytest.raises(NavigationError, match="CANCELLED"):
        workspace.run(grid, 0, 399 * 400, 0, ExpansionLimits(cancel=cancel))
    assert workspace.expanded == 0
    assert kernels.CHECKED == 1024  # 0.1 ms of work


def maze(side=2000):
    """Walls across in every twentieth row, gaps at alternating ends: nothing left unexpanded."""
    cells = np.zeros((side, side), dtype=np.uint8)
    cells[10::20] = INSCRIBED_COST
    cells[10::40, -5:] = cells[30::40, :5] = 0
    return CostGrid(cells, 0.05)


@pytest.mark.parametrize("name", ["astar", "theta_star"])
def test_a_cancelled_plan_stops_early_and_the_next_one_does_not_wait_for_it(name):
    """The flag is seen by compiled code that runs without the interpreter's lock."""
    begun = Event()
    made = planner(name, max_expansions=1_000_000_000)

    class Announcing:
        def plan(self, costs, start, goal, options):
            begun.set()
            return made.plan(costs, start, goal, options)

    worker, grid = PlannerWorker(Announcing()), maze()
    far = PlanRequest(grid, Pose2D(1.0, 0.1), (Pose2D(99.0, 99.9),))
    near = PlanRequest(open_floor(100), START, (Pose2D(3.0, 3.0),))
    try:
        first = worker.ask(far, 0.0)
        assert begun.wait(60.0)
        second = worker.ask(near, 0.0)
        first.drop()
        assert second.result(0.0).path.length == pytest.approx(8**0.5, rel=0.01)
        answer = first.result(0.0)
        assert isinstance(answer, Failure) and answer.code == FailureCode.CANCELLED
    finally:
        worker.close()


def test_closing_the_worker_cancels_its_plans():
    worker = PlannerWorker(planner("theta_star"))
    tickets = [
        worker.ask(PlanRequest(maze(), Pose2D(1.0, 0.1), (Pose2D(99.0, 99.9),)), 0.0)
        for _ in range(3)
    ]
    worker.close()
    assert [ticket.result(0.0).code for ticket in tickets] == [FailureCode.CANCELLED] * 3


@pytest.mark.parametrize(("wait", "time"), [(True, 0.0), (False, 0.3)])
def test_a_planner_that_hangs_fails_its_plans_and_does_not_hold_the_end(monkeypatch, wait, time):
    """On hardware (`wait` is false) the robot's clock goes on: 0.2 s after the plan was due."""
    monkeypatch.setattr(Patience, "LONGEST", 0.2)

    class Hanging:
        def plan(self, costs, start, goal, options):
            Event().wait()

    worker = PlannerWorker(Hanging(), is_real_time=not wait)
    request = PlanRequest(open_floor(100), START, (Pose2D(3.0, 3.0),))
    for _ in range(2):
        ticket = worker.ask(request, 0.0)
        while not worker.await_results(time, 0.01):
            pass
        failure = ticket.result(time)
        assert failure.code is FailureCode.EXCEPTION
        assert failure.sentence == "the planner gave no result for 0.2 s"
    worker.close()


def test_options_may_be_a_keyword_only_argument():
    class KeywordOnly(Planner):
        def plan(self, costs, start, goal, *, options):
            return planner("astar").plan(costs, start, goal, options)

    worker = PlannerWorker(KeywordOnly(None, ROBOT))
    ticket = worker.ask(PlanRequest(open_floor(100), START, (Pose2D(3.0, 3.0),)), 0.0)
    assert ticket.result(0.0).path.length == pytest.approx(8**0.5, rel=0.01)
    worker.close()


@st.composite
def shut_off_goals(draw):
    """Random cells with unreachable upper rows, a start below and a goal above."""
    random = np.random.default_rng(draw(st.integers(0, 2**32)))
    cells = random.integers(0, 200, (30, 30)).astype(np.uint8)
    cells[random.random((30, 30)) < draw(st.sampled_from([0.1, 0.3, 0.45]))] = INSCRIBED_COST
    cells[20] = INSCRIBED_COST
    start = draw(st.integers(0, 19)), draw(st.integers(0, 29))
    goal = draw(st.integers(21, 29)), draw(st.integers(0, 29))
    cells[start] = cells[goal] = 0
    return cells, start, goal


def flooded(cells, start):
    """(n, 2) cells connected to a start by steps that cut no corner, the start included."""
    reached, waiting = {start}, [start]

    def passable(row, column):
        return 0 <= row < 30 and 0 <= column < 30 and cells[row, column] < INSCRIBED_COST

    while waiting:
        row, column = waiting.pop()
        for rise, run in product((-1, 0, 1), repeat=2):
            near = row + rise, column + run
            sides = passable(row, near[1]) and passable(near[0], column)
            if passable(*near) and sides and near not in reached:
                reached.add(near)
                waiting.append(near)
    return np.array(sorted(reached))


@pytest.mark.parametrize("name", ["astar", "theta_star"])
@given(shut_off_goals())
@settings(deadline=None, max_examples=60)
def test_a_partial_plan_ends_in_the_nearest_reachable_cell(name, case):
    cells, start, goal = case
    grid = CostGrid(cells, 0.05)
    ends = [Pose2D(*grid.centre_of(*cell), 0.4) for cell in (start, goal)]
    made = planner(name, tolerance=0.0)
    path = made.plan(grid, *ends, PlanOptions(partial=True))
    away = np.hypot(*(flooded(cells, start) - np.array(goal)).T).min()
    assert path.partial
    assert path.goal.distance_to(ends[1]) == pytest.approx(0.05 * away, abs=1e-9)
    assert plan_failure(made, grid, *ends, PlanOptions()).code == FailureCode.NO_VALID_PATH


@pytest.mark.parametrize("name", PLANNERS)
def test_only_partial_plans_are_marked_partial(name):
    cells = np.full((100, 100), FREE, dtype=np.int8)
    cells[49:51] = OCCUPIED
    grid = Costmap(CostmapParameters(), ROBOT.footprint, OccupancyGrid(cells, 0.05)).grid
    start, beyond, here = Pose2D(1.0, 1.0), Pose2D(3.0, 4.0), Pose2D(3.0, 1.0)
    partial = planner(name).plan(grid, start, beyond, PlanOptions(partial=True))
    # 0.22 m below the wall's lower face at y = 2.45, in a cell's middle
    assert partial.partial and partial.goal.y == pytest.approx(2.22, abs=0.06)
    assert planner(name, allow_partial=True).plan(grid, start, beyond).partial
    assert not planner(name).plan(grid, start, here, PlanOptions(partial=True)).partial
    blocked = Pose2D(3.0, 2.32)  # too near to the wall, by less than the tolerance of 0.2 m
    assert not planner(name).plan(grid, start, blocked, PlanOptions(partial=True)).partial
