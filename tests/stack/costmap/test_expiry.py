"""Expiry of marks within the box of all marks, against a search of every cell."""

from math import inf

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap import kernels
from stack.costmap.choosing import read_layers
from stack.costmap.costmap import Costmap
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
    cleared, kept = kernels.expire(marked_at, oldest, top, top + 5, left, left + 5)
    assert np.array_equal(marked_at, expected)
    for (low, high, first, last), cells in ((cleared, old), (kept, expected > -inf)):
        rows, columns = np.nonzero(cells)
        if rows.size:
            assert (low, high, first, last) == (
                rows.min(), rows.max() + 1, columns.min(), columns.max() + 1,
            )  # fmt: skip
        else:
            assert low >= high or first >= last


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
