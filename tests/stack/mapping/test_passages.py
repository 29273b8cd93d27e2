"""Passages on maps drawn by hand: widths and places are counted in cells."""

import cv2
import numpy as np
import pytest

from stack.mapping.passages import clearance_of, passages_of, widest_path_to, widest_paths
from stack.types import OccupancyGrid


def two_rooms(gap: int) -> OccupancyGrid:
    """Two rooms of 2 × 3 m at 5 cm, a wall at x = 2.0..2.05 m with a gap of so many cells."""
    cells = np.full((62, 83), 100, dtype=np.int8)
    cells[1:61, 1:41] = 0
    cells[1:61, 42:82] = 0
    cells[30 : 30 + gap, 41] = 0
    return OccupancyGrid(cells, 0.05)


@pytest.mark.parametrize("gap", [8, 12, 18])
def test_a_gap_of_n_cells_is_a_passage_of_that_width(gap):
    grid = two_rooms(gap)
    (passage,) = passages_of(grid, clearance_of(grid))
    # The clearance of a middle cell reaches to the wall's edge: half the gap, or half a cell less.
    assert passage.width == pytest.approx(gap * 0.05, abs=0.051)
    assert passage.x == pytest.approx(2.075, abs=0.06)
    assert passage.y == pytest.approx((30 + gap / 2) * 0.05, abs=0.06)


def test_every_gap_between_two_rooms_is_a_passage():
    grid = two_rooms(18)
    grid.cells[6:14, 41] = 0
    narrow, wide = passages_of(grid, clearance_of(grid))
    assert (narrow.width, wide.width) == pytest.approx((0.4, 0.9), abs=0.051)
    assert (narrow.y, wide.y) == pytest.approx((0.5, 1.95), abs=0.06)


@pytest.mark.parametrize("degrees", range(0, 180, 15))
def test_one_gap_in_an_oblique_wall_is_one_passage(degrees):
    cells = np.zeros((160, 160), np.uint8)
    cells[[0, -1], :] = cells[:, [0, -1]] = 100
    along = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))])
    for side in (-1, 1):  # a gap of 0.9 m about the middle
        ends = [80 + side * along * away for away in (9, 200)]
        cv2.line(cells, *(tuple(map(round, end)) for end in ends), 100, 2)
    grid = OccupancyGrid(cells.astype(np.int8), 0.05)
    (passage,) = passages_of(grid, clearance_of(grid))
    assert (passage.x, passage.y) == pytest.approx((4.0, 4.0), abs=0.2)


def test_without_a_gap_there_is_no_passage_and_no_path():
    grid = two_rooms(0)
    clearance = clearance_of(grid)
    assert passages_of(grid, clearance) == []
    paths = widest_paths(grid, clearance, (1.0, 1.5))
    assert widest_path_to(grid, paths, 3.0, 1.5).width == 0.0


def test_the_widest_path_names_its_narrowest_point():
    grid = two_rooms(10)
    clearance = clearance_of(grid)
    path = widest_path_to(grid, widest_paths(grid, clearance, (1.0, 1.5)), 3.0, 1.5)
    assert path.width == pytest.approx(0.5, abs=0.051)
    assert (path.x, path.y) == pytest.approx((2.075, 1.75), abs=0.06)


def test_no_cell_is_reached_from_a_start_inside_a_wall():
    grid = two_rooms(10)
    paths = widest_paths(grid, clearance_of(grid), (0.0, 0.0))
    assert not paths[0].any()


def test_clearance_in_the_middle_of_a_room_is_half_its_narrow_side():
    grid = two_rooms(0)
    # 40 cells across: 20 cells from the middle, less the half cell to the wall's edge
    assert clearance_of(grid)[30, 20] == pytest.approx(0.975, abs=0.03)
