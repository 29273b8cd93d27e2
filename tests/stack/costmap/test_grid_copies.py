"""Copies of a costmap for the planner: stable while used, then updated where it changed."""

import numpy as np

from stack.costmap.costmap import Costmap
from stack.costmap.grid_copies import CHANGES_REMEMBERED
from stack.costmap.parameters import CostmapParameters
from stack.types import FREE, Footprint, OccupancyGrid, Pose2D, Scan
from tests.stack.costmap.marks import seen

ROUND = Footprint.circle(0.22)


def floor(rows=120, columns=120):
    return OccupancyGrid(np.full((rows, columns), FREE, dtype=np.int8), 0.05, (0.0, 0.0))


def see(costmap, distance, time, pose=Pose2D(3.0, 3.0)):
    scan = Scan(time, np.array([distance], dtype=np.float32), 0.0, 0.01, 0.08, 12.0)
    costmap.update(seen(pose, scan, time))


def test_a_copy_stays_as_it_is_until_it_is_released():
    costmap = Costmap(CostmapParameters(), ROUND, floor())
    see(costmap, 1.0, 0.0)
    copy = costmap.copied()
    before = copy.grid.cells.copy()
    see(costmap, 1.6, 0.1)
    other = costmap.copied()
    assert other.grid.cells is not copy.grid.cells
    assert np.array_equal(copy.grid.cells, before)
    assert np.array_equal(other.grid.cells, costmap.grid.cells)
    assert not np.array_equal(before, costmap.grid.cells)


def test_a_released_copy_is_used_again_with_every_change_since():
    costmap = Costmap(CostmapParameters(), ROUND, floor())
    first = costmap.copied()
    first.release()
    for step, distance in enumerate((0.7, 1.4, 2.1)):
        see(costmap, distance, 0.1 * step, Pose2D(1.0 + step, 1.0 + step))
    second = costmap.copied()
    assert second.grid.cells is first.grid.cells
    assert np.array_equal(second.grid.cells, costmap.grid.cells)


def test_only_changed_cells_are_copied():
    """So that a plan on a map of 64 million cells does not begin with copying all of them."""
    costmap = Costmap(CostmapParameters(), ROUND, floor())
    copy = costmap.copied()
    copy.grid.cells[5, 5] = 77  # in a corner: the robot sees 1 m ahead of (3, 3)
    copy.release()
    see(costmap, 1.0, 0.0)
    again = costmap.copied().grid.cells
    differ = again != costmap.grid.cells
    assert differ[5, 5] and np.count_nonzero(differ) == 1


def test_a_copy_older_than_the_changes_remembered_is_made_anew():
    costmap = Costmap(CostmapParameters(), ROUND, floor())
    old = costmap.copied()
    old.release()
    for step in range(CHANGES_REMEMBERED + 1):
        see(costmap, 1.0 + 0.5 * (step % 2), 0.1 * step)
    new = costmap.copied()
    assert new.grid.cells is not old.grid.cells
    assert np.array_equal(new.grid.cells, costmap.grid.cells)


def test_a_copy_of_a_smaller_map_is_not_used_again():
    costmap = Costmap(CostmapParameters(), ROUND, floor())
    copy = costmap.copied()
    costmap.set_static(floor(200, 160))
    copy.release()  # by a planner that was slower than the new map
    assert costmap.copied().grid.cells.shape == (200, 160)


def test_a_copy_follows_a_rolling_window():
    costmap = Costmap(CostmapParameters(), ROUND, None, window=4.0)
    see(costmap, 1.0, 0.0, Pose2D(0.0, 0.0))
    costmap.copied().release()
    see(costmap, 1.0, 0.1, Pose2D(1.0, 0.0))
    grid = costmap.copied().grid
    assert grid.origin == costmap.grid.origin
    assert np.array_equal(grid.cells, costmap.grid.cells)


def test_the_shown_costs_are_current_and_the_changes_name_every_changed_cell():
    costmap = Costmap(CostmapParameters(), ROUND, floor())
    before, version = costmap.shown.cells.copy(), costmap.version
    assert costmap.shown.cells is costmap.shown.cells  # no copy without a change
    for step, distance in enumerate((0.7, 1.4, 2.1)):
        see(costmap, distance, 0.1 * step, Pose2D(1.0 + step, 1.0 + step))
    after = costmap.shown.cells
    assert np.array_equal(after, costmap.grid.cells)
    since = [item for item in costmap.changes if item[0] > version]
    assert [number for number, _ in since] == [*range(version + 1, costmap.version + 1)]
    named = np.zeros(after.shape, bool)
    for _, (top, bottom, left, right) in since:
        named[top:bottom, left:right] = True
    assert (after != before).any() and not ((after != before) & ~named).any()
    costmap.configure(CostmapParameters(inflation_radius=0.2))  # repaints everything
    assert costmap.changes == () and np.array_equal(costmap.shown.cells, costmap.grid.cells)
