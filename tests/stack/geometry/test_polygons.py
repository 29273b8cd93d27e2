"""Polygons against closed forms and against OpenCV."""

from math import cos, hypot, pi, sin

import cv2
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stack.geometry.polygons import fill_polygon, outline_points, points_inside
from stack.types import LETHAL_COST, CostGrid, Footprint, Pose2D
from tests.stack.planning.footprint_check import first_blocked, footprint_cost

BAR = Footprint(np.array([[-0.1, -0.1], [0.5, -0.1], [0.5, 0.1], [-0.1, 0.1]]))
L_SHAPE = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]])


def grid_with(*occupied):
    cells = np.zeros((80, 80), dtype=np.uint8)
    grid = CostGrid(cells, 0.05, (-2.0, -2.0))
    for place in occupied:
        cells[grid.cell_at(*place)] = LETHAL_COST
    return grid


def test_the_notch_of_a_concave_polygon_is_outside():
    points = np.array([[0.5, 0.5], [1.5, 0.5], [0.5, 1.5], [1.5, 1.5], [-0.1, 0.5], [2.1, 0.5]])
    assert points_inside(points, L_SHAPE).tolist() == [True, True, True, False, False, False]
    assert points_inside(points, L_SHAPE[::-1]).tolist() == [True, True, True, False, False, False]


def test_adjacent_polygons_share_no_point_and_leave_none_out():
    left = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    on_the_seam = np.column_stack([np.ones(5), np.linspace(0.1, 0.9, 5)])
    right = left + np.array([1.0, 0.0])
    owners = np.stack([points_inside(on_the_seam, square) for square in (left, right)])
    assert np.all(owners.sum(axis=0) == 1)


@st.composite
def star_polygons(draw):
    """Simple polygons: radii around the origin at increasing angles."""
    n = draw(st.integers(3, 9))
    radii = draw(st.lists(st.floats(0.3, 2.0), min_size=n, max_size=n))
    turn = draw(st.floats(0.0, 2.0 * pi))
    return np.array(
        [
            [radius * cos(turn + 2.0 * pi * k / n), radius * sin(turn + 2.0 * pi * k / n)]
            for k, radius in enumerate(radii)
        ]
    )


@given(star_polygons(), st.floats(-2.0, 2.0), st.floats(-2.0, 2.0))
@settings(deadline=None, max_examples=300)
def test_inside_agrees_with_opencv(corners, x, y):
    distance = cv2.pointPolygonTest(corners.astype(np.float32), (x, y), True)
    assume(abs(distance) > 1e-4)  # OpenCV rounds corners to float32
    assert points_inside(np.array([[x, y]]), corners)[0] == (distance > 0.0)


def test_the_outline_has_every_corner_and_no_gap():
    points = outline_points(L_SHAPE, 0.3)
    gaps = np.linalg.norm(points - np.roll(points, -1, axis=0), axis=1)
    assert gaps.max() <= 0.3 + 1e-12
    assert gaps.sum() == pytest.approx(8.0)  # the perimeter: 2 + 1 + 1 + 1 + 1 + 2
    for corner in L_SHAPE:
        assert np.linalg.norm(points - corner, axis=1).min() < 1e-12


def test_filling_leaves_no_gap_inside():
    points = fill_polygon(L_SHAPE, 0.1)
    rng = np.random.default_rng(1)
    probes = rng.uniform(0.0, 2.0, (500, 2))
    probes = probes[points_inside(probes, L_SHAPE)]
    nearest = [np.linalg.norm(points - probe, axis=1).min() for probe in probes]
    assert max(nearest) <= 0.1 * hypot(0.5, 0.5) + 1e-9  # half the diagonal of a lattice square


@pytest.mark.parametrize(
    ("x", "y", "cell"),
    [(0.0, 0.01, (0.2, 0.12)), (0.0, -0.01, (0.2, -0.12)), (0.01, 0.0, (0.52, 0.02)),
     (-0.01, 0.0, (-0.12, 0.02))],
)  # fmt: skip
def test_a_cell_that_an_edge_reaches_by_a_centimetre_counts(x, y, cell):
    """The bar is 0.6 m by 0.2 m; its edges lie on the sides of cells until it moves by 1 cm."""
    assert footprint_cost(grid_with(cell), BAR, Pose2D(x, y)) == LETHAL_COST
    assert footprint_cost(grid_with(cell), BAR, Pose2D(-3.0 * x, -3.0 * y)) == 0


@given(
    st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-pi, pi), st.floats(0, 1), st.floats(0, 1)
)
@settings(deadline=None, max_examples=200)
def test_no_cell_under_a_footprint_is_missed(x, y, heading, forward, left):
    # a point at least 7 cm inside lies in a cell (5 cm, diagonal 7.07 cm) wholly inside
    pose = Pose2D(x, y, heading)
    inside = pose.compose(Pose2D(-0.029 + 0.458 * forward, -0.029 + 0.058 * left))
    assert footprint_cost(grid_with((inside.x, inside.y)), BAR, pose) == LETHAL_COST


def test_the_check_of_plans_finds_the_first_pose_in_contact():
    points = np.column_stack([np.linspace(-1.5, 1.5, 31), np.zeros(31), np.zeros(31)])
    grid = grid_with((0.525, 0.3))
    assert first_blocked(grid, points, Footprint.circle(0.2)) is None
    # a cell 0.25..0.30 m aside; the round robot of 0.27 m reaches it where x is within 0.1 m
    index = first_blocked(grid, points, Footprint.circle(0.27))
    assert index is not None and points[index, 0] == pytest.approx(0.45, abs=0.06)
