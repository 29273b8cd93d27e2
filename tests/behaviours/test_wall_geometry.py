from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviours._sensing.wall_geometry import (
    CONTOUR_SPACING,
    CURVE_STEP,
    WallCourse,
    bridges,
    chains_of,
    contour_of,
    filled,
    offset_curve,
    room_ahead,
    smoothed,
)
from stack.streams import stream

AHEAD = np.array([1.0, 0.0])
LEFT = WallCourse(side=1, distance=0.5, closest=0.3)


def wall(start, end, spacing=0.05):
    start, end = np.array(start, float), np.array(end, float)
    count = round(float(np.linalg.norm(end - start)) / spacing) + 1
    return start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)


def test_strays_are_left_out_and_the_seam_of_the_scan_is_closed():
    points = np.vstack([wall((1, 0), (1, 1)), [[3.0, 3.0]], wall((1, -1), (1, -0.05))])
    [chain] = chains_of(points)
    assert len(chain) == len(points) - 1


@given(st.floats(-pi, pi), st.floats(0.3, 3.0))
@settings(deadline=None, max_examples=30)
def test_smoothing_leaves_a_straight_wall_where_it_is(angle, distance):
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    points = wall((-1, distance), (1, distance)) @ turn
    assert smoothed(points) == pytest.approx(points, abs=1e-9)


def test_smoothing_takes_most_of_the_noise_away():
    clean = wall((-1, 0.5), (1, 0.5), 0.02)
    noise = stream(3, "wall").normal(0.0, 0.01, len(clean))
    left = smoothed(clean + np.column_stack([np.zeros_like(noise), noise]))[10:-10, 1] - 0.5
    assert left.std() < 0.004  # about ten points count: 1 cm / sqrt(10) = 3.2 mm


def test_filled_points_are_close_together_and_on_the_chain():
    chain = np.array([[0.0, 0.0], [0.25, 0.0], [0.25, 0.1]])
    points = filled(chain)
    assert np.linalg.norm(np.diff(points, axis=0), axis=1).max() <= CONTOUR_SPACING + 1e-12
    assert points[0] == pytest.approx(chain[0]) and points[-1] == pytest.approx(chain[-1])
    assert np.all((points[:, 1] == 0.0) | (points[:, 0] == 0.25))


def test_a_doorway_in_line_is_bridged_a_wider_one_and_another_wall_are_not():
    near, far = wall((-1, 0.5), (0, 0.5)), wall((0.9, 0.5), (2, 0.5))
    found = bridges([near, far], gap=1.2)
    assert len(found) == 2  # one from each side
    for bridge in found:
        assert sorted(bridge[:, 0]) == pytest.approx([0.0, 0.9], abs=1e-6)
        assert bridge[:, 1] == pytest.approx(0.5)
    assert bridges([near, far], gap=0.8) == []
    assert bridges([near, far + np.array([0.0, 0.3])], gap=1.2) == []
    assert bridges([near, wall((0.9, 0.0), (0.9, 1.0))], gap=1.2) == []


def test_the_curve_runs_along_a_straight_wall():
    curve = offset_curve(contour_of(wall((-1, 0.8), (3, 0.8)), 1.2), LEFT, AHEAD)
    assert curve.wall_distance == pytest.approx(0.8, abs=1e-3)
    assert curve.tangent == pytest.approx(AHEAD, abs=0.05)
    assert curve.points[:, 1] == pytest.approx(0.3, abs=2e-3)
    assert np.diff(curve.points[:, 0]) == pytest.approx(CURVE_STEP, abs=5e-3)


def test_the_curve_rounds_an_outer_corner_on_an_arc():
    corner = np.array([0.3, 0.5])
    curve = offset_curve(contour_of(wall((-2, 0.5), corner), 1.2), LEFT, AHEAD)
    past = curve.points[curve.points[:, 0] > corner[0] + 0.1]
    assert len(past) > 5
    assert np.linalg.norm(past - corner, axis=1) == pytest.approx(0.5, abs=0.03)


def test_the_curve_swings_round_the_end_of_a_thin_wall():
    points = np.vstack([wall((0.3, 0.6), (-2, 0.6)), wall((-2, 0.5), (0.3, 0.5))])
    curve = offset_curve(contour_of(points, 1.2), LEFT, AHEAD, length=3.0)
    assert curve.points[-1, 1] == pytest.approx(1.1, abs=0.03)
    assert curve.points[-1, 0] < 0.0


def test_the_curve_turns_before_a_wall_ahead():
    points = np.vstack([wall((0.9, -2), (0.9, 0.5))[:-1], wall((0.9, 0.5), (-2, 0.5))])
    curve = offset_curve(contour_of(points, 1.2), LEFT, AHEAD)
    assert curve.points[:, 0].max() == pytest.approx(0.4, abs=0.06)
    assert curve.points[-1, 1] < -0.4


def test_the_right_side_is_the_mirror_of_the_left():
    points = np.vstack([wall((0.9, -2), (0.9, 0.5))[:-1], wall((0.9, 0.5), (-2, 0.5))])
    left = offset_curve(contour_of(points, 1.2), LEFT, AHEAD)
    mirror = points * (1.0, -1.0)
    right = offset_curve(contour_of(mirror, 1.2), WallCourse(-1, 0.5, 0.3), AHEAD)
    assert right.points * (1.0, -1.0) == pytest.approx(left.points)


@pytest.mark.parametrize(("across", "expected"), [(0.9, 0.45), (1.4, 0.5)])
def test_a_narrow_passage_is_driven_in_its_middle(across, expected):
    points = np.vstack([wall((-2, 0.3), (3, 0.3)), wall((-2, 0.3 - across), (3, 0.3 - across))])
    curve = offset_curve(contour_of(points, 1.2), LEFT, AHEAD)
    assert 0.3 - curve.points[:, 1] == pytest.approx(expected, abs=5e-3)


def test_a_passage_too_narrow_is_turned_back_from():
    points = np.vstack([wall((-2, 0.5), (3, 0.5)), wall((0.5, 0.0), (3, 0.0))])
    curve = offset_curve(contour_of(points, 1.2), LEFT, AHEAD)
    passed = curve.points[curve.points[:, 0] > 0.5]
    assert np.all(passed[:, 1] < -0.4)  # below the lower wall, not between the two


def test_nothing_on_that_side():
    assert offset_curve(contour_of(wall((-1, -2), (1, -2)), 1.2), LEFT, AHEAD) is None
    assert offset_curve(np.empty((0, 2)), LEFT, AHEAD) is None
    assert contour_of(np.empty((0, 2)), 1.2).shape == (0, 2)


def test_room_ahead_looks_down_the_lane_only():
    points = np.array([[0.5, 0.4], [0.8, 0.1], [-0.3, 0.0]])
    assert room_ahead(points, 0.25) == 0.8
    assert room_ahead(points[:1], 0.25) == np.inf
