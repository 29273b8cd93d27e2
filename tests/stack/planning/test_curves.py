"""Dubins and Reeds-Shepp curves: known lengths, and properties of shortest curves."""

from math import cos, pi, sin, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from stack.planning.curves import kernels

BOTH, FORWARD = True, False
poses = st.tuples(st.floats(-6, 6), st.floats(-6, 6), st.floats(-pi, pi))


def length(both_ways, x, y, heading):
    """In turning radii."""
    return float(np.abs(kernels.curve(both_ways, x, y, heading)[1]).sum())


# Drawn by hand with radius 1; the last two are three arcs of one side, the other and the first.
KNOWN = [
    (FORWARD, (3.0, 0.0, 0.0), 3.0),  # straight on
    (FORWARD, (1.0, 1.0, pi / 2), pi / 2),  # a quarter turn
    (FORWARD, (0.0, 2.0, pi), pi),  # half a circle
    (FORWARD, (0.0, 0.0, pi), 7 * pi / 3),  # arcs of 60, 300 and 60 degrees
    (BOTH, (-2.0, 0.0, 0.0), 2.0),  # straight back
    (BOTH, (0.0, 0.0, pi), pi),  # three arcs of 60 degrees, there and back and there
    (BOTH, (1.0, 1.0, pi / 2), pi / 2),
]


@pytest.mark.parametrize(("both_ways", "goal", "expected"), KNOWN)
def test_lengths_known_from_drawings(both_ways, goal, expected):
    assert length(both_ways, *goal) == pytest.approx(expected, abs=1e-9)


def test_a_lateral_offset_by_dubins_is_two_arcs_and_a_tangent():
    # LSR to (d, 2, 0): circles around (0, 1) and (d, 1): the inner tangent has length
    # sqrt(d² - 4), each arc the angle between it and the x axis, asin(2 / d)
    d = 5.0
    assert length(FORWARD, d, 2.0, 0.0) == pytest.approx(
        sqrt(d * d - 4.0) + 2.0 * np.arcsin(2.0 / d), abs=1e-9
    )


@given(poses, st.sampled_from([BOTH, FORWARD]), st.floats(0.3, 2.0))
@settings(deadline=None, max_examples=300)
def test_a_curve_ends_where_it_should_and_bends_no_tighter_than_its_radius(goal, both_ways, radius):
    letters, lengths = kernels.curve(both_ways, goal[0] / radius, goal[1] / radius, goal[2])
    along, directions = kernels.sample(0.0, 0.0, 0.0, letters, lengths, radius, 0.05)
    if not len(along):
        assert goal == pytest.approx((0.0, 0.0, 0.0), abs=1e-6)
        return
    assert along[-1, :2] == pytest.approx(goal[:2], abs=1e-6)
    assert cos(along[-1, 2] - goal[2]) == pytest.approx(1.0, abs=1e-9)
    assert both_ways or np.all(directions == 1)
    assert both_ways or np.all(lengths >= 0.0)
    points = np.vstack([[0.0, 0.0, 0.0], along])
    turned = np.abs(np.angle(np.exp(1j * np.diff(points[:, 2]))))
    chords = np.hypot(*np.diff(points[:, :2], axis=0).T)
    assert np.all(2.0 * radius * np.sin(0.5 * turned) <= chords + 1e-9)


@given(poses, poses, st.sampled_from([BOTH, FORWARD]))
@settings(deadline=None, max_examples=500)
def test_no_path_over_a_third_pose_is_shorter(goal, way_point, both_ways):
    dx, dy = goal[0] - way_point[0], goal[1] - way_point[1]
    c, s = cos(way_point[2]), sin(way_point[2])
    rest = c * dx + s * dy, c * dy - s * dx, goal[2] - way_point[2]
    # who ends a rounding error behind the start, forward only, has to drive a whole circle
    assume(all(max(map(abs, pose)) > 1e-6 for pose in (goal, way_point, rest)))
    detour = length(both_ways, *way_point) + length(both_ways, *rest)
    assert length(both_ways, *goal) <= detour + 1e-6


@given(poses)
@settings(deadline=None, max_examples=200)
def test_reeds_shepp_is_never_longer_and_is_symmetric(goal):
    x, y, heading = goal
    shortest = length(BOTH, x, y, heading)
    # Next to 0 a length is the root of a rounding error: up to some 1e-5.
    assert shortest <= length(FORWARD, x, y, heading) + 5e-5
    assert length(BOTH, x, -y, -heading) == pytest.approx(shortest, abs=1e-6)
    assert length(BOTH, -x, y, -heading) == pytest.approx(shortest, abs=1e-6)
    c, s = cos(heading), sin(heading)
    assert length(BOTH, -c * x - s * y, s * x - c * y, -heading) == pytest.approx(
        shortest, abs=1e-6
    )


def test_the_table_holds_lengths_to_the_origin():
    table = kernels.distance_table(FORWARD, 2, 1.0, 8)
    # from (-2, 0) along x it is 2 straight on; from (2, 0) a long detour
    assert table[0, 2, 0] == pytest.approx(2.0)
    assert table[4, 2, 0] == pytest.approx(length(FORWARD, -2.0, 0.0, 0.0), abs=1e-5)
    # from (0, 2) looking back (4 of 8 turns): half a circle to the left ends at the origin
    assert table[2, 4, 4] == pytest.approx(pi, abs=1e-5)
