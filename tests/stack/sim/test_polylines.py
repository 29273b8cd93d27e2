"""Rounded corners of polylines."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.sim.worlds.polylines import rounded

CORNER = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])


def length(points):
    return np.linalg.norm(np.diff(points, axis=0), axis=1).sum()


def test_a_corner_becomes_a_quarter_of_a_circle():
    curve = rounded(CORNER, 0.5)
    arc = curve[1:-1]
    assert np.linalg.norm(arc - [1.5, 0.5], axis=1) == pytest.approx(0.5)
    # 1.5 m on each side and a quarter of a circle of 0.5 m, in 18 chords.
    assert length(curve) == pytest.approx(3.0 + 0.5 * pi / 2, abs=1e-3)


def test_no_radius_leaves_the_corners():
    assert rounded(CORNER, 0.0).tolist() == CORNER.tolist()


def test_a_closed_square_with_large_arcs_is_a_circle():
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    circle = rounded(square, 5.0, closed=True)
    assert np.linalg.norm(circle - 1.0, axis=1) == pytest.approx(1.0)
    assert np.allclose(circle[0], circle[-1])
    assert length(circle) == pytest.approx(2 * pi, rel=1e-3)


@given(st.lists(st.tuples(st.integers(-5, 5), st.integers(-5, 5)), min_size=2, max_size=8),
       st.floats(0.01, 10.0))  # fmt: skip
def test_a_rounded_line_keeps_its_ends_and_is_never_longer(corners, radius):
    points = np.array(corners, dtype=float)
    points = points[np.r_[True, np.any(np.diff(points, axis=0) != 0, axis=1)]]
    if len(points) < 2:
        return
    curve = rounded(points, radius)
    assert np.allclose(curve[[0, -1]], points[[0, -1]])
    assert length(curve) <= length(points) + 1e-9
    assert np.all(np.linalg.norm(np.diff(curve, axis=0), axis=1) > 0.0)
