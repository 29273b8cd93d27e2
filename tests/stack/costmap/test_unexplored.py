"""Ground without a map: large enough for what is asked, and what was sensed stays in its place."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.costmap.unexplored import MARGIN, GrowingMap, unexplored
from stack.errors import ParameterError
from stack.types import LETHAL_COST, UNKNOWN, UNKNOWN_COST, Footprint, Pose2D, Scan
from tests.stack.costmap.marks import seen

COORDINATES = st.floats(-40.0, 40.0, allow_nan=False)


def bounds(grid):
    rows, columns = grid.cells.shape
    (x, y), side = grid.origin, grid.resolution
    return x, y, x + columns * side, y + rows * side


@settings(deadline=None, max_examples=40)
@given(COORDINATES, COORDINATES, COORDINATES, COORDINATES, st.sampled_from([0.05, 0.1, 0.03]))
def test_the_ground_reaches_a_margin_beyond_every_pose(x1, y1, x2, y2, resolution):
    grid = unexplored([Pose2D(x1, y1), Pose2D(x2, y2)], resolution)
    left, low, right, high = bounds(grid)
    assert left <= min(x1, x2) - MARGIN + 1e-6 and low <= min(y1, y2) - MARGIN + 1e-6
    assert right >= max(x1, x2) + MARGIN - 1e-6 and high >= max(y1, y2) + MARGIN - 1e-6
    assert (grid.cells == UNKNOWN).all()
    assert grid.origin[0] / resolution == pytest.approx(round(grid.origin[0] / resolution))


def test_places_too_far_apart_are_refused_with_the_figures():
    with pytest.raises(ParameterError, match=r"without a map, poses .* m apart"):
        unexplored([Pose2D(0.0, 0.0), Pose2D(1000.0, 0.0)], 0.01)


def test_sensed_obstacles_keep_their_place_when_the_ground_grows():
    grid = unexplored([Pose2D(0.0, 0.0)], 0.05)
    costmap = Costmap(CostmapParameters(), Footprint.circle(0.2), grid)
    scan = Scan(0.0, np.array([1.02], np.float32), 0.0, 0.1, 0.1, 10.0)
    costmap.update(seen(Pose2D(0.0, 0.0), scan, 0.0))
    assert costmap.grid.cells[costmap.grid.cell_at(1.02, 0.01)] == LETHAL_COST

    ground = GrowingMap(grid, [costmap])
    ground.cover([Pose2D(2.0, 2.0)])
    assert ground.grid is grid  # it was there already
    ground.cover([Pose2D(-30.0, 25.0)])
    grown = costmap.grid
    assert grown.cells[grown.cell_at(1.02, 0.01)] == LETHAL_COST
    assert (grown.cells == LETHAL_COST).sum() == 1
    assert grown.contains(*grown.cell_at(-30.0, 25.0))
    assert grown.cells[grown.cell_at(-30.0, 25.0)] == UNKNOWN_COST


def test_a_place_beyond_all_bounds_stays_outside():
    grid = unexplored([Pose2D(0.0, 0.0)], 0.05)
    ground = GrowingMap(grid, [])
    ground.cover([Pose2D(1e6, 0.0)])
    assert ground.grid is grid
