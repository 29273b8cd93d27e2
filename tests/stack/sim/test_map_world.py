"""A ROS map as walls: exactly its occupied cells, in few boxes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from stack.errors import InputError
from stack.sim.import_world import read_any_world
from stack.sim.worlds.rasterise import rasterise
from stack.sim.worlds.rectangles import merged_cells
from stack.types import FREE, OCCUPIED, OccupancyGrid
from tests.stack.mapping.written_maps import write_ros_map


@settings(deadline=None, max_examples=100)
@given(arrays(bool, st.tuples(st.integers(1, 12), st.integers(1, 12))))
def test_the_rectangles_cover_each_occupied_cell_once(occupied):
    covered = np.zeros(occupied.shape, int)
    for top, bottom, left, right in merged_cells(occupied):
        covered[top:bottom, left:right] += 1
    assert (covered == occupied).all()


def test_a_straight_wall_is_one_box():
    occupied = np.zeros((40, 60), bool)
    occupied[10:12, 5:50] = True
    assert merged_cells(occupied) == [(10, 12, 5, 50)]


def test_the_map_of_the_world_of_a_map_is_the_map(tmp_path):
    cells = np.full((60, 80), FREE, np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = OCCUPIED, OCCUPIED
    cells[20:40, 30] = OCCUPIED
    grid = OccupancyGrid(cells, 0.05, (-1.0, 2.0))
    write_ros_map(grid, tmp_path / "flat.yaml")
    world = read_any_world(tmp_path / "flat.yaml")
    assert world.bounds == pytest.approx((-1.0, 2.0, 3.0, 5.0))
    again = rasterise(world, 0.05)
    assert (again.cells == cells).all()
    row, column = grid.cell_at(world.start.x, world.start.y)
    assert (cells[row - 9 : row + 10, column - 9 : column + 10] == FREE).all()  # 0.45 m of room


def test_an_empty_map_is_no_world(tmp_path):
    write_ros_map(OccupancyGrid(np.zeros((5, 5), np.int8), 0.1), tmp_path / "a.yaml")
    with pytest.raises(InputError, match=r"E206.*no cell of this map is occupied"):
        read_any_world(tmp_path / "a.yaml")
