"""Hybrid A* and the lattice: drivable, collision-free paths to the goal."""

from dataclasses import replace
from functools import lru_cache, partial
from math import pi
from pathlib import Path as FilePath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import PlanOptions, choose
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.differential import Wheels
from stack.errors import NavigationError
from stack.geometry.polygons import fill_polygon
from stack.planning.astar import Astar, AstarParameters
from stack.planning.kinematic.hybrid_astar import HybridAstar, HybridAstarParameters
from stack.planning.kinematic.lattice import Lattice, LatticeParameters
from stack.planning.kinematic.moves import lattice_headings, lattice_moves
from stack.planning.kinematic.search import CollisionChecker
from stack.planning.search import StepCosts
from stack.planning.smoothers.choice import SMOOTHERS
from stack.types import (
    FREE,
    LETHAL_COST,
    OCCUPIED,
    CostGrid,
    FailureCode,
    Footprint,
    OccupancyGrid,
    Path,
    Pose2D,
)
from tests.stack.planning.footprint_check import first_blocked, footprint_cost
from tests.stack.planning.office_maps import office

BOX = Footprint(np.array([[0.3, -0.2], [0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2]]))
WEDGE = Footprint(np.array([[0.9, 0.0], [-0.2, 0.3], [-0.1, -0.25]]))
ROBOT = RobotDescription("box", BOX, 0.4, FilePath("none.urdf"), Wheels((), (), 0.05, 0.3))
FORWARD = HybridAstarParameters(motion="dubins")
BOTH = HybridAstarParameters()
RADIUS = 0.4
"""Metres that hybrid A* uses for robots that turn in place, as its parameter says."""


@lru_cache(maxsize=4)
def costs_of_office(seed):
    return Costmap(CostmapParameters(), BOX, office(200, seed)).grid


def costs_of(cells):
    return Costmap(CostmapParameters(), BOX, OccupancyGrid(cells, 0.05)).grid


def open_floor(side=100):
    return CostGrid(np.zeros((side, side), dtype=np.uint8), 0.05)


def wrapped(angles):
    return np.angle(np.exp(1j * np.asarray(angles)))


def curvature(points):
    """Between neighbours of (n, 3): turn of the heading over the arc length of the chord."""
    turns = np.abs(wrapped(np.diff(points[:, 2])))
    chords = np.hypot(*np.diff(points[:, :2], axis=0).T)
    return turns / (chords * (0.5 * turns) / np.maximum(np.sin(0.5 * turns), 1e-12) + 1e-12)


def directions_of(points):
    """+1 where a step goes along the mean heading, -1 against it, and how far off it points."""
    directions = np.arctan2(*np.diff(points[:, :2], axis=0).T[::-1])
    middle = points[:-1, 2] + 0.5 * wrapped(np.diff(points[:, 2]))
    off = wrapped(directions - middle)
    way = np.where(np.abs(off) < pi / 2, 1, -1)
    return way, np.abs(wrapped(off + np.where(way < 0, pi, 0.0)))


def assert_drivable(points, radius):
    way, slip = directions_of(points)
    assert slip.max() < 0.1  # no step goes sideways
    assert curvature(points).max() <= 1.1 / radius
    return way


@given(
    st.integers(0, 3), st.integers(0, 2**32), st.sampled_from(["dubins", "reeds_shepp", "lattice"]),
    st.sampled_from(SMOOTHERS),
)  # fmt: skip
@settings(deadline=None, max_examples=60)
def test_plans_are_drivable_collision_free_and_end_at_the_goal(office_seed, seed, kind, smoother):
    grid, random = costs_of_office(office_seed), np.random.default_rng(seed)
    free = np.argwhere(grid.cells < 200)
    start, goal = (
        Pose2D(*grid.centre_of(*free[n]), random.uniform(-3.1, 3.1))
        for n in random.integers(0, len(free), 2)
    )
    if any(footprint_cost(grid, BOX, pose) >= LETHAL_COST for pose in (start, goal)):
        return
    more = {"tolerance": 0.0, "smoother": smoother, "max_expansions": 20_000}
    if kind == "lattice":
        planner = partial(Lattice, LatticeParameters(**more), ROBOT)
    else:
        planner = partial(HybridAstar, HybridAstarParameters(motion=kind, **more), ROBOT)
    try:
        points = planner().plan(grid, start, goal).points
    except NavigationError as error:
        assert error.failure.code in (FailureCode.NO_VALID_PATH, FailureCode.TIMED_OUT)
        return
    assert points[0, :2] == pytest.approx([start.x, start.y])
    assert points[-1] == pytest.approx([goal.x, goal.y, goal.heading])
    assert first_blocked(grid, points, BOX) is None
    if kind != "lattice":  # which turns in place
        assert points[0, 2] == pytest.approx(start.heading)
        way = assert_drivable(points, RADIUS)
        assert kind == "reeds_shepp" or np.all(way == 1)
    assert np.array_equal(points, planner().plan(grid, start, goal).points)


@pytest.mark.parametrize("kind", ["hybrid_astar", "lattice"])
def test_every_goal_that_a_point_reaches_with_clearance_is_found(kind):
    planner_of = choose("planner", kind, {"tolerance": 0.0})
    planner = planner_of.component(planner_of.parameters, ROBOT)
    found = 0
    for seed in range(3):
        grid, random = costs_of_office(seed), np.random.default_rng(seed)
        roomy = np.argwhere(grid.cells == 0)
        for _ in range(6):
            start, goal = (
                Pose2D(*grid.centre_of(*roomy[n]), random.uniform(-3.1, 3.1))
                for n in random.integers(0, len(roomy), 2)
            )
            try:
                Astar(AstarParameters(tolerance=0.0), ROBOT).plan(grid, start, goal)
            except NavigationError:
                continue
            points = planner.plan(grid, start, goal).points
            assert points[-1] == pytest.approx([goal.x, goal.y, goal.heading])
            assert first_blocked(grid, points, BOX) is None
            found += 1
    assert found > 10


def test_on_open_floor_the_path_is_the_shortest_curve():
    # half a circle of radius 0.5 to the left: pi / 2 long
    planner = HybridAstar(
        replace(FORWARD, turning_radius=0.5, smoother="none", non_straight_penalty=1.0), ROBOT
    )
    path = planner.plan(open_floor(), Pose2D(2.5, 2.0, 0.0), Pose2D(2.5, 3.0, pi))
    assert path.length == pytest.approx(pi / 2, rel=0.01)


def test_into_a_parking_space_it_backs_up():
    cells = np.full((80, 160), FREE, dtype=np.int8)
    cells[:20] = OCCUPIED
    cells[4:20, 70:90] = FREE  # a slot 1 m wide, 0.8 m deep, from below
    grid = costs_of(cells)
    goal = Pose2D(4.0, 0.65, pi / 2)
    points = HybridAstar(BOTH, ROBOT).plan(grid, Pose2D(2.0, 2.0, 0.0), goal).points
    assert points[-1] == pytest.approx([4.0, 0.65, pi / 2])
    assert first_blocked(grid, points, BOX) is None
    way = assert_drivable(points, RADIUS)
    assert way[-1] == -1 and np.any(way == 1)
    forward = HybridAstar(FORWARD, ROBOT)
    with pytest.raises(NavigationError, match="but not with heading"):  # facing out
        forward.plan(grid, Pose2D(2.0, 2.0, 0.0), goal)


def test_a_long_robot_is_not_planned_around_a_corner_that_only_its_centre_passes():
    cells = np.full((100, 100), OCCUPIED, dtype=np.int8)
    cells[40:52, 5:60] = FREE  # 0.6 m wide, then a right angle
    cells[40:95, 48:60] = FREE
    long = Footprint(np.array([[0.6, -0.2], [0.6, 0.2], [-0.6, 0.2], [-0.6, -0.2]]))
    robot = replace(ROBOT, footprint=long)
    grid = Costmap(CostmapParameters(), long, OccupancyGrid(cells, 0.05)).grid
    start, goal = Pose2D(1.2, 2.3, 0.0), Pose2D(2.7, 4.0, pi / 2)
    assert Astar(AstarParameters(), robot).plan(grid, start, goal).length > 2.0
    for planner in (HybridAstar(BOTH, robot), Lattice(LatticeParameters(), robot)):
        with pytest.raises(NavigationError, match="NO_VALID_PATH"):
            planner.plan(grid, start, goal)


def test_lattice_moves_end_at_cell_centres_and_lattice_headings():
    headings = lattice_headings()
    for turn, moves in enumerate(lattice_moves(0.5, 0.05, True)):
        c, s = np.cos(headings[turn]), np.sin(headings[turn])
        for move in moves:
            x, y, angle = move.poses[-1]
            cells = np.array([c * x - s * y, s * x + c * y]) / 0.05
            assert cells == pytest.approx(np.rint(cells), abs=1e-6)
            assert np.abs(wrapped(headings - headings[turn] - angle)).min() < 1e-9
            if move.kind in (1, -1):
                assert curvature(np.vstack([[0, 0, 0], move.poses])).max() <= 1.0 / 0.5 + 1e-6


PLANNERS = [
    lambda **more: HybridAstar(replace(BOTH, **more), ROBOT),
    lambda **more: Lattice(LatticeParameters(**more), ROBOT),
]


def split_floor():
    cells = np.full((100, 100), FREE, dtype=np.int8)
    cells[49:51] = OCCUPIED
    return costs_of(cells)


@pytest.mark.parametrize("planner", PLANNERS)
def test_an_unreachable_goal_fails_at_once_or_is_approached(planner):
    start, goal = Pose2D(1.0, 1.0, 0.0), Pose2D(3.0, 4.0, 0.0)
    with pytest.raises(NavigationError, match="NO_VALID_PATH: no path from"):
        planner().plan(split_floor(), start, goal)
    end = planner(allow_partial=True).plan(split_floor(), start, goal).goal
    # the wall begins at y = 2.45; lying along it the robot's half width of 0.2 m fits below
    assert end.y == pytest.approx(2.2, abs=0.06) and end.x == pytest.approx(3.0, abs=0.06)


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_goal_too_close_to_a_wall_moves_away_from_it_within_the_tolerance(planner):
    start, goal = Pose2D(1.0, 1.0, 0.0), Pose2D(3.0, 2.32, 0.0)
    end = planner(tolerance=0.2).plan(split_floor(), start, goal).goal
    assert end.distance_to(goal) <= 0.2 and end.heading == pytest.approx(0.0)
    with pytest.raises(NavigationError, match="GOAL_OCCUPIED: the robot does not fit at goal"):
        planner(tolerance=0.05).plan(split_floor(), start, goal)


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_start_in_contact_is_left(planner):
    start, goal = Pose2D(2.0, 2.3, pi / 2), Pose2D(2.0, 1.0, pi / 2)  # its nose is in the wall
    grid = split_floor()
    points = planner().plan(grid, start, goal).points
    assert points[-1] == pytest.approx([2.0, 1.0, pi / 2])
    assert first_blocked(grid, points[15:], BOX) is None


@pytest.mark.parametrize("planner", PLANNERS)
def test_failures_have_the_codes_of_astar(planner):
    grid, inside = split_floor(), Pose2D(1.0, 1.0)
    cases = [
        (Pose2D(-1.0, 1.0), inside, FailureCode.START_OUTSIDE_MAP),
        (inside, Pose2D(1.0, 6.0), FailureCode.GOAL_OUTSIDE_MAP),
    ]
    for start, goal, code in cases:
        with pytest.raises(NavigationError) as caught:
            planner().plan(grid, start, goal)
        assert caught.value.failure.code == code
    walled = grid.cells.copy()
    walled[:40] = LETHAL_COST
    with pytest.raises(NavigationError, match="START_OCCUPIED"):
        planner().plan(CostGrid(walled, 0.05), inside, Pose2D(3.0, 4.0))


@pytest.mark.parametrize("planner", PLANNERS)
def test_the_limit_of_expansions_is_a_failure_that_says_so(planner):
    grid = costs_of_office(0)
    free = np.argwhere(grid.cells == 0)
    start, goal = (Pose2D(*grid.centre_of(*free[n]), 1.0) for n in (10, -10))
    with pytest.raises(NavigationError, match=r"TIMED_OUT: .* found within 3 expansions"):
        planner(max_expansions=3).plan(grid, start, goal)


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_path_that_is_followed_is_replaced_only_by_a_cheaper_one(planner):
    planner = planner()
    start, goal = Pose2D(1.0, 1.0), Pose2D(4.0, 3.0, 0.5)
    current = planner.plan(open_floor(), start, goal)
    with pytest.raises(NavigationError) as raised:
        planner.plan(open_floor(), start, goal, PlanOptions(current=current))
    assert raised.value.failure.code == FailureCode.NO_VALID_PATH

    aside = Pose2D(1.0, 4.0, pi / 2)  # a detour
    legs = planner.plan(open_floor(), start, aside), planner.plan(open_floor(), aside, goal)
    detour = Path(np.vstack([legs[0].points, legs[1].points[1:]]))
    better = planner.plan(open_floor(), start, goal, PlanOptions(current=detour))
    assert better.length == pytest.approx(current.length, rel=0.02)
    elsewhere = replace(detour, points=detour.points - [0.1, 0.0, 0.0])
    assert planner.plan(open_floor(), start, goal, PlanOptions(current=elsewhere)).goal == goal


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_path_that_is_blocked_is_replaced_by_a_longer_one(planner):
    planner = planner()
    start, goal = Pose2D(1.0, 2.5), Pose2D(4.0, 2.5)
    current = planner.plan(open_floor(), start, goal)
    floor = open_floor()
    floor.cells[44:57, 50] = LETHAL_COST
    around = planner.plan(floor, start, goal, PlanOptions(current=current))
    assert around.length > current.length + 0.1
    floor = open_floor()
    floor.cells[54, 50] = LETHAL_COST  # a footprint of 0.4 m just touches it: a reading's noise
    with pytest.raises(NavigationError):
        planner.plan(floor, start, goal, PlanOptions(current=current))


@pytest.mark.parametrize("planner", PLANNERS)
def test_a_goal_at_the_start_gives_two_poses_or_more(planner):
    pose = Pose2D(2.0, 2.0, 0.5)
    points = planner().plan(open_floor(), pose, pose).points
    assert len(points) >= 1 and points[-1] == pytest.approx([2.0, 2.0, 0.5])


@given(
    st.integers(0, 999), st.sampled_from([BOX, WEDGE]), st.sampled_from([0.0, 0.002, 0.02, 0.2]),
    st.floats(0.0, 2.99), st.floats(0.0, 2.99), st.floats(-4.0, 4.0),
)  # fmt: skip
@settings(deadline=None, max_examples=100)
def test_contacts_are_those_of_every_sample(seed, footprint, share, x, y, heading):
    """Tiles of samples far from lethal cells are left out: that changes no count."""
    cells = np.where(np.random.default_rng(seed).random((60, 60)) < share, LETHAL_COST, 0)
    costs = CostGrid(cells.astype(np.uint8), 0.05, (0.0, 0.0))
    checker = CollisionChecker.of(costs, footprint, StepCosts.of(3.0, allow_unknown=False))
    pose = Pose2D(x, y, heading)
    column, row = np.floor(pose.transform(checker.grid.samples) / 0.05).astype(int).T
    on_grid = (row >= 0) & (row < 60) & (column >= 0) & (column < 60)
    expected = np.count_nonzero(cells[row[on_grid], column[on_grid]] == LETHAL_COST)
    expected += cells[int(y / 0.05), int(x / 0.05)] == LETHAL_COST
    assert len(checker.grid.samples) == len(fill_polygon(footprint.points, 0.7 * 0.05))
    assert checker.contacts(pose) == expected
    assert (checker.weight(np.array([[x, y, heading]])) == 0.0) == (expected > 0)
