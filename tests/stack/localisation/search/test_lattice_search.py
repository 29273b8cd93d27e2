"""Branch and bound returns what an exhaustive search of the same lattice returns."""

from math import hypot, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.localisation.search.lattice_search import (
    HIGHEST,
    LatticeSearch,
    SearchLimits,
    SearchWindow,
    build_pyramid,
)
from stack.types import Pose2D

RESOLUTION = 0.1


def exhaustive(values, allowed, offsets, limits, period):
    """All lattice poses by score, then heading, row, column; those distinct from better ones."""
    rows, columns = values.shape
    margin = 200
    padded = np.pad(np.rint(HIGHEST * values).astype(int), margin)
    found = []
    for heading, cells in enumerate(offsets):
        total = sum(
            padded[margin + r : margin + r + rows, margin + c : margin + c + columns]
            for r, c in cells
        )
        found += [(-total[r, c], heading, r, c) for r, c in np.argwhere(allowed & (total > 0))]
    kept = []
    reach, turn = limits.distance / RESOLUTION, 2.0 * pi / period
    for score, heading, row, column in sorted(found):
        least = limits.least * HIGHEST * offsets.shape[1]
        if -score < max(least, limits.fraction * -kept[0][0] if kept else 0.0):
            break
        apart = [min(abs(h - heading), period - abs(h - heading)) * turn for _, h, _, _ in kept]
        near = [hypot(r - row, c - column) < reach for _, _, r, c in kept]
        if not any(n and a < limits.angle - 1e-9 for n, a in zip(near, apart, strict=True)):
            kept.append((score, heading, row, column))
        if len(kept) == limits.most:
            break
    return kept


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10**6),
    rows=st.integers(1, 23),
    columns=st.integers(1, 23),
    points=st.integers(1, 12),
    fraction=st.sampled_from([0.5, 0.8, 1.0]),
    most=st.sampled_from([1, 5, 80]),
)
def test_it_equals_an_exhaustive_search(seed, rows, columns, points, fraction, most):
    generator = np.random.default_rng(seed)
    values = generator.choice([0.0, 0.2, 0.7, 1.0], (rows, columns), p=[0.6, 0.2, 0.1, 0.1])
    allowed = generator.random((rows, columns)) < 0.7
    cloud = generator.uniform(-1.5, 1.5, (points, 2))
    limits = SearchLimits(fraction=fraction, least=0.05, most=most)
    search = LatticeSearch(values, allowed, RESOLUTION, (0.0, 0.0), RESOLUTION)
    period = 24
    headings = np.arange(period) * (2.0 * pi / period)
    found = search.search(cloud, 2.0 * pi / period, limits)
    expected = exhaustive(values, allowed, search.offsets(cloud, headings), limits, period)
    assert found.complete
    assert [round(s * HIGHEST * points) for s in found.scores] == [-e[0] for e in expected]
    poses = [(headings[h], (r + 0.5) * 0.1, (c + 0.5) * 0.1) for _, h, r, c in expected]
    assert found.poses[:, [2, 1, 0]] == pytest.approx(np.array(poses).reshape(-1, 3))


@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 10**6), rows=st.integers(1, 70), columns=st.integers(1, 70))
def test_a_pyramid_bounds_every_box(seed, rows, columns):
    generator = np.random.default_rng(seed)
    grid = generator.integers(0, 256, (rows, columns)).astype(np.uint8)
    pyramid = build_pyramid(grid)
    padded = np.pad(grid, 130)
    for level, (start, high, wide, shift, pad) in enumerate(pyramid.layout):
        side = 1 << level
        for _ in range(5):
            row, column = generator.integers(-side, [rows, columns])
            box = padded[130 + row : 130 + row + side, 130 + column : 130 + column + side]
            i, j = (row >> shift) + pad, (column >> shift) + pad
            inside = 0 <= i < high and 0 <= j < wide
            bound = pyramid.cells[start + i * wide + j] if inside else 0
            if level <= 2:
                assert bound == box.max(initial=0)
            else:
                assert bound >= box.max(initial=0)


def test_a_window_limits_positions_and_headings():
    generator = np.random.default_rng(3)
    values = (generator.random((60, 60)) < 0.2).astype(float)
    search = LatticeSearch(values, np.ones((60, 60), bool), RESOLUTION, (-1.0, 2.0), RESOLUTION)
    window = SearchWindow(Pose2D(2.0, 5.0, 3.0), 0.5, 0.3)
    found = search.search(
        generator.uniform(-2, 2, (20, 2)), 0.05, SearchLimits(0.5, distance=0.1), window
    )
    assert len(found.poses) > 3
    assert np.all(np.abs(found.poses[:, :2] - (2.0, 5.0)) <= 0.5 + RESOLUTION)
    assert np.all(np.abs(found.poses[:, 2] - 3.0) <= 0.3 + 1e-9)


def test_the_limit_of_boxes_is_reported():
    generator = np.random.default_rng(3)
    values = generator.random((50, 50))
    search = LatticeSearch(values, np.ones((50, 50), bool), RESOLUTION, (0.0, 0.0), RESOLUTION)
    cloud = generator.uniform(-1, 1, (20, 2))
    assert not search.search(cloud, 0.1, SearchLimits(0.5, boxes=200)).complete
    assert search.search(np.empty((0, 2)), 0.1, SearchLimits()).poses.shape == (0, 3)
