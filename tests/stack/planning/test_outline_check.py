"""Planners without an outline, for long and off-centre robots: no plan touches with the outline."""

from math import pi
from pathlib import Path as FilePath

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.components import choose
from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.drivetrain.description import RobotDescription
from stack.drivetrain.differential import Wheels
from stack.errors import NavigationError
from stack.geometry.polygons import widest_disc
from stack.planning.kinematic.search import CollisionChecker
from stack.planning.outline_check import OutlineChecked, is_free, outline_checked, swept_poses
from stack.planning.search import StepCosts
from stack.types import FREE, OCCUPIED, Footprint, OccupancyGrid, Path, Pose2D
from tests.stack.planning.footprint_check import first_blocked


def rectangle(length, width, ahead=0.5, turn=0.0, aside=0.5):
    """A rectangle of which `ahead` of the length lies before the base, and `aside` to its left."""
    x, y = np.array([ahead - 1.0, ahead]) * length, np.array([aside - 1.0, aside]) * width
    corners = np.array([[x[1], y[0]], [x[1], y[1]], [x[0], y[1]], [x[0], y[0]]])
    return Footprint(Pose2D(0.0, 0.0, turn).transform(corners))


def robot(footprint):
    return RobotDescription("long", footprint, 0.4, FilePath("none.urdf"), Wheels((), (), 0.1, 0.5))


SIDES = st.floats(0.2, 2.0)
SHARES = st.floats(0.02, 0.98)


@settings(deadline=None, max_examples=40)
@given(length=SIDES, width=SIDES, ahead=SHARES, aside=SHARES, turn=st.floats(-pi, pi))
def test_the_width_of_a_rectangle_is_its_shorter_side_wherever_the_base_is(
    length, width, ahead, aside, turn
):
    found = rectangle(length, width, ahead, turn, aside)
    assert found.width == pytest.approx(min(length, width), abs=1e-9)
    _, _, radius = widest_disc(found.points)
    assert radius == pytest.approx(min(length, width) / 2, abs=5e-3)


def test_widths_of_other_shapes():
    triangle = Footprint(np.array([[1.0, 0.0], [0.0, 0.6], [0.0, -0.6]]))  # base on its edge
    # Its altitudes: 1 m, and 1.2 m · 1 m / hypot(1, 0.6) = 1.029 m.
    assert triangle.width == pytest.approx(1.0)
    x, y, radius = widest_disc(triangle.points)
    # Incircle: twice the area, 1.2 m², over the perimeter, 1.2 + 2 · 1.1662 m.
    assert (x, y, radius) == pytest.approx((0.3397, 0.0, 0.3397), abs=4e-3)
    corner = Footprint(np.array([[0, 0], [1, 0], [1, 0.3], [0.3, 0.3], [0.3, 1], [0, 1]], float))
    # An L, base at its corner; across the diagonal 0.919 = 1.3 / sqrt(2) of its hull's edge.
    assert corner.width == pytest.approx(1.3 / 2**0.5, abs=1e-9)
    assert 0.15 <= widest_disc(corner.points)[2] <= 0.3 / (1 + 2**-0.5)
    disc = Footprint.circle(0.22)
    assert widest_disc(disc.points) == pytest.approx((0.0, 0.0, 0.22))
    assert disc.width == pytest.approx(0.44)
    assert disc.half_width == disc.inscribed_radius  # exactly: lanes of round robots stay
    assert rectangle(1.2, 0.7, 5 / 6).half_width == pytest.approx(0.35)


@pytest.mark.parametrize(
    ("footprint", "is_compact"),
    [
        (Footprint.circle(0.3), True), (rectangle(0.6, 0.6), True), (rectangle(0.9, 0.6), True),
        (rectangle(1.2, 0.6), False), (rectangle(0.6, 0.6, 0.8), False),
        (rectangle(1.2, 0.7, 5 / 6), False), (rectangle(0.6, 0.6, 0.5, aside=0.1), False),
    ],
)  # fmt: skip
def test_planners_of_long_and_off_centre_robots_are_checked_and_no_others(footprint, is_compact):
    assert footprint.is_compact == is_compact
    for name in ("astar", "theta_star"):
        made = outline_checked(choose("planner", name, {}), robot(footprint))
        assert isinstance(made, OutlineChecked) is not is_compact
    exact = outline_checked(choose("planner", "lattice", {}), robot(footprint))
    assert not isinstance(exact, OutlineChecked)


def test_turns_in_place_are_swept_from_the_robots_own_heading():
    path = Path(np.array([[0.0, 0.0, pi / 2], [0.0, 1.0, pi / 2], [0.0, 1.0, -pi]]))
    poses = swept_poses(Pose2D(0.0, 0.0, 0.0), path)
    assert np.abs(np.diff(np.unwrap(poses[:, 2]))).max() <= 0.1 + 1e-9
    assert poses[0, 2] == 0.0 and tuple(poses[-1, :2]) == (0.0, 1.0)


def test_what_stands_between_two_points_of_a_path_is_noticed():
    """Planners of plugins may return corners alone; a wall crosses the middle of a side of 3 m."""
    cells = np.full((40, 80), FREE, np.int8)
    cells[:, 40] = OCCUPIED
    made = robot(rectangle(1.0, 0.5))
    costs = Costmap(CostmapParameters(), made.footprint, OccupancyGrid(cells, 0.05)).grid
    checker = CollisionChecker.of(costs, made.footprint, StepCosts.of(0.0, allow_unknown=False))
    path = Path(np.array([[0.7, 1.0, 0.0], [3.3, 1.0, 0.0]]))
    assert not is_free(checker, Pose2D(0.7, 1.0, 0.0), path)
    assert is_free(checker, Pose2D(0.7, 1.0, 0.0), Path(np.array([[0.7, 1, 0], [1.3, 1, 0.0]])))


def two_rooms(gap, resolution=0.05):
    """5 x 5 m, a wall across the middle with a gap; the way round it is at the top, 1.6 m wide."""
    cells = np.full((100, 100), FREE, np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = OCCUPIED, OCCUPIED
    cells[:67, 49:51] = OCCUPIED
    half = round(gap / resolution / 2)
    cells[30 - half : 30 + half, 49:51] = FREE
    return OccupancyGrid(cells, resolution)


@settings(deadline=None, max_examples=8)
@given(
    gap=st.floats(0.3, 1.2), ahead=st.sampled_from([0.15, 0.5, 0.85]),
    name=st.sampled_from(["astar", "theta_star"]), aside=st.sampled_from([0.5, 0.3]),
)  # fmt: skip
def test_no_plan_touches_whatever_the_gap_and_the_place_of_the_base(gap, ahead, name, aside):
    made = robot(rectangle(1.0, 0.5, ahead, aside=aside))
    costs = Costmap(CostmapParameters(), made.footprint, two_rooms(gap)).grid
    start, goal = Pose2D(1.2, 1.5, 0.0), Pose2D(3.8, 1.5, 0.0)
    path = outline_checked(choose("planner", name, {}), made).plan(costs, start, goal)
    assert first_blocked(costs, swept_poses(start, path), made.footprint) is None
    assert path.goal.distance_to(goal) < 0.21


def test_without_any_way_the_failure_is_that_of_the_outline():
    made = robot(rectangle(1.2, 0.7, 5 / 6))
    grid = two_rooms(0.6)
    grid.cells[67:, 49:51] = OCCUPIED
    costs = Costmap(CostmapParameters(), made.footprint, grid).grid
    planner = outline_checked(choose("planner", "astar", {}), made)
    with pytest.raises(NavigationError, match="no path from") as error:
        planner.plan(costs, Pose2D(1.2, 1.5, 0.0), Pose2D(3.2, 1.5, 0.0))
    assert error.value.failure.code == "NO_VALID_PATH"
