"""Expiry of marks within the box of all marks, against a search of every cell."""

from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap import kernels
from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
from stack.costmap.layer import NO_BOX, shifted
from stack.costmap.mark_boxes import MarkBoxes
from stack.costmap.parameters import CostmapParameters
from stack.types import FREE, Footprint, OccupancyGrid, Pose2D, RangeReading, Scan
from tests.stack.costmap.marks import seen, sensed

PARAMETERS = CostmapParameters(inflation_radius=0.0, decay=3.0)
BEAMS = 30


def expire_everywhere(marked_at, oldest):
    """The search of every cell that the box replaces."""
    old = (marked_at > -inf) & (marked_at < oldest)
    marked_at[old] = -inf
    return old


@settings(deadline=None)  # the first call compiles the kernel
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 10.0))
def test_expiry_clears_what_a_search_of_every_cell_clears(seed, oldest):
    random = np.random.default_rng(seed)
    marked_at = np.full((20, 30), -inf, dtype=np.float32)
    top, left = random.integers(0, 15), random.integers(0, 25)
    part = marked_at[top : top + 5, left : left + 5]
    part[:] = np.where(random.random(part.shape) < 0.3, random.uniform(0.0, 10.0, part.shape), -inf)
    expected = marked_at.copy()
    old = expire_everywhere(expected, oldest)
    cleared, kept, earliest = kernels.expire(marked_at, oldest, top, top + 5, left, left + 5)
    assert np.array_equal(marked_at, expected)
    assert earliest == expected[expected > -inf].min(initial=inf)
    for (low, high, first, last), cells in ((cleared, old), (kept, expected > -inf)):
        rows, columns = np.nonzero(cells)
        if rows.size:
            assert (low, high, first, last) == (
                rows.min(), rows.max() + 1, columns.min(), columns.max() + 1,
            )  # fmt: skip
        else:
            assert low >= high or first >= last


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_expiry_in_tiles_clears_what_a_search_of_every_cell_clears(seed):
    """Random boxes with marks, moves of the grid, and expiries, on 3 x 3 tiles of 128 cells."""
    random = np.random.default_rng(seed)
    shape = (300, 330)
    marked_at, boxes = np.full(shape, -inf, dtype=np.float32), MarkBoxes()
    for time in range(12):
        top, left = random.integers(0, 280, 2)
        box = (top, min(top + random.integers(1, 200), 300), left, left + 40)
        seen_now = random.random((box[1] - box[0], 40)) < 0.05
        marked_at[box[0] : box[1], box[2] : box[3]][seen_now] = time
        boxes.add(box, time if random.random() < 0.8 else -inf)
        if time % 4 == 1:
            shift = tuple(int(n) for n in random.integers(-60, 60, 2))
            marked_at = shifted(marked_at, shape, shift, -inf)
            boxes.move(shape, shift)
        expected = marked_at.copy()
        rows, columns = np.nonzero(expire_everywhere(expected, time - 3.0))
        cleared = boxes.expire(marked_at, time - 3.0)
        assert np.array_equal(marked_at, expected)
        if rows.size:
            assert cleared == (rows.min(), rows.max() + 1, columns.min(), columns.max() + 1)
        else:
            assert cleared == NO_BOX


def test_expiry_searches_the_way_that_was_driven_not_the_square_around_it():
    """2400 cells along a diagonal in boxes of 240: 60 m at 2.5 cm, 3 m seen on each side."""
    marked_at, boxes = np.full((2700, 2700), -inf, dtype=np.float32), MarkBoxes()
    for n in range(0, 2401, 8):
        boxes.add((n, n + 240, n, n + 240))
        marked_at[n + 239, n] = n  # a wall 3 m to the left of the way
    assert boxes.expire(marked_at, 0.0) == NO_BOX
    searched = sum((b - a) * (d - c) for a, b, c, d in boxes._boxes.values())
    assert searched < 0.1 * 2639 * 2401  # the box around all marks


@pytest.mark.parametrize("window", [4.0, None])
@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_marks_of_a_moving_robot_expire_wherever_they_are(window, seed):
    """Random drives, rolls and clearings: nothing older than the decay and one period remains."""
    random = np.random.default_rng(seed)
    static = OccupancyGrid(np.full((160, 160), FREE, np.int8), 0.05, (-4.0, -4.0))
    layers = read_layers(["obstacle", {"use": "range", "decay": 3.0}], PARAMETERS)
    costmap = Costmap(PARAMETERS, Footprint.circle(0.1), static, window=window, layers=layers)
    pose, time = Pose2D(0.0, 0.0), 0.0
    for _ in range(25):
        time += float(random.uniform(0.1, 1.0))
        x, y = random.uniform(-0.8, 0.8, 2)
        pose = Pose2D(float(np.clip(pose.x + x, -3, 3)), float(np.clip(pose.y + y, -3, 3)))
        ranges = np.where(random.random(BEAMS) < 0.5, random.uniform(0.3, 3.0, BEAMS), np.nan)
        scan = Scan(time, ranges.astype(np.float32), 0.0, 2.0 * np.pi / BEAMS, 0.08, 12.0)
        sonar = RangeReading(time, float(random.uniform(0.3, 2.0)), 0.5, 0.02, 4.0)
        costmap.update(seen(pose, scan, time, readings=[sonar]))
        if random.random() < 0.1:
            costmap.clear_around(pose, 1.0)
        if random.random() < 0.05:
            costmap.set_static(static)
    assert sensed(costmap).any()
    for later in (2.9, 3.6):  # the second is a decay and an expiry period after the last data
        costmap.update(seen(pose, None, time + later))
    assert not sensed(costmap).any()
