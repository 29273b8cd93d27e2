"""Pictures of grids: every cell has the colour of its value, the last row on top."""

import numpy as np

from stack.telemetry import grid_colours


def test_each_cell_of_a_costmap_has_the_colour_of_its_value():
    cells = np.arange(256, dtype=np.uint8).reshape(8, 32)
    for layer in ("global_costmap", "local_costmap"):
        table = grid_colours.cost_table(layer)
        picture = grid_colours.coloured(cells, table)
        assert picture.dtype == np.uint8 and picture.flags.c_contiguous
        for row in range(8):
            for column in range(32):
                assert (picture[7 - row, column] == table[cells[row, column]]).all()


def test_a_map_is_darker_where_it_is_free_and_darkest_where_it_is_unknown():
    cells = np.array([[-1, 0, 50], [100, 100, 0]], dtype=np.int8)
    picture = grid_colours.coloured(cells.view(np.uint8), grid_colours.map_table())
    assert picture.shape == (2, 3, 4) and (picture[..., 3] == 255).all()
    assert picture[1, :, 0].tolist() == [15, 33, 72]  # 72: halfway from 33 to 112, rounded
    assert picture[0, :, 0].tolist() == [112, 112, 33]
