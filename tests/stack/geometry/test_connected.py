"""Connected cells, compared with OpenCV and by hand."""

import cv2
import numpy as np
import pytest

from stack.geometry.connected import connected_to


def grid(*rows):
    return np.array([[cell == "." for cell in row] for row in rows])


def test_cells_are_connected_over_edges_and_corners():
    free = grid("..##", ".##.", "##.#", "...#")
    assert connected_to(free, [(0, 0)]).tolist() == grid("..##", ".###", "####", "####").tolist()
    assert connected_to(free, [(3, 0)]).tolist() == grid("####", "###.", "##.#", "...#").tolist()
    assert connected_to(free, [(0, 0), (1, 3)]).tolist() == free.tolist()


def test_the_last_column_does_not_touch_the_first_of_the_next_row():
    assert connected_to(grid("#.", "##", ".#"), [(0, 1)]).sum() == 1
    assert connected_to(grid("##.", ".##", "###"), [(0, 2)]).sum() == 1


def test_nothing_is_connected_to_an_occupied_cell():
    assert not connected_to(grid("..", "#."), [(1, 0)]).any()
    assert not connected_to(grid("##"), []).any()


@pytest.mark.parametrize("seed", range(20))
def test_random_grids_have_the_parts_that_opencv_finds(seed):
    random = np.random.default_rng(seed)
    free = random.random((40, 57)) < random.uniform(0.3, 0.7)
    _, labels = cv2.connectedComponents(free.astype(np.uint8), connectivity=8)
    row, column = np.argwhere(free)[random.integers(free.sum())].tolist()
    expected = free & (labels == labels[row, column])
    assert np.array_equal(connected_to(free, [(row, column)]), expected)
