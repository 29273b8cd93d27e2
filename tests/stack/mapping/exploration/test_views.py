"""What is in view on a map: a room of 4 x 4 m with a wall between two halves."""

import numpy as np
import pytest

from stack.mapping.exploration.frontiers import frontiers_of
from stack.mapping.exploration.views import cells_in_view, only_in_view
from stack.types import FREE, OCCUPIED, UNKNOWN, OccupancyGrid, Pose2D

CELL = 0.05


def room(wall_to=3.0):
    """80 x 80 cells; a wall at x = 2 m from y = 0 to `wall_to`."""
    cells = np.full((80, 80), FREE, np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = OCCUPIED
    cells[: round(wall_to / CELL), 40] = OCCUPIED
    return OccupancyGrid(cells, CELL)


def test_a_wall_hides_what_is_behind_it():
    seen = cells_in_view(room(), Pose2D(1.0, 1.0), 10.0)
    assert seen[20, 20] and seen[20, 35]
    assert not seen[20, 45]
    assert not seen[:20, 41:].any()
    # Past the wall's end at (2, 3) the line of sight rises by 2 m per metre.
    assert seen[75, 44] and not seen[62, 46]


def test_the_reach_is_a_circle():
    seen = cells_in_view(room(wall_to=0.0), Pose2D(2.0, 2.0), 1.0)
    assert np.count_nonzero(seen) * CELL**2 == pytest.approx(np.pi, rel=0.06)


def test_walls_stay_and_free_cells_out_of_view_become_unknown():
    grid = room()
    shown = only_in_view(grid, [Pose2D(1.0, 1.0)], 10.0)
    assert (shown.cells[grid.occupied] == OCCUPIED).all()
    assert shown.cells[20, 45] == UNKNOWN and shown.cells[20, 20] == FREE
    assert grid.cells[20, 45] == FREE


def test_a_place_outside_the_map_shows_nothing():
    assert not cells_in_view(room(), Pose2D(-3.0, 1.0), 2.0).any()


def test_the_next_view_is_where_the_other_half_can_be_seen():
    grid, here = room(), Pose2D(1.0, 1.0)
    views = frontiers_of(only_in_view(grid, [here], 10.0), here, 0.2)
    best = max(views, key=lambda view: view.gain)
    assert best.middle[0] > 1.9 and best.middle[1] > 2.8
    both = only_in_view(grid, [here, Pose2D(3.0, 3.0)], 10.0)
    left = sum(view.gain for view in frontiers_of(both, here, 0.2))
    assert left < 0.25 * best.gain
