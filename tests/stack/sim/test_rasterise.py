"""Maps drawn from worlds: which cells, worked out by hand on squared paper."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from stack.errors import ParameterError
from stack.sim.worlds.rasterise import rasterise
from stack.sim.worlds.world import Box, Cylinder, Door, Wall, World
from stack.types import FREE, OCCUPIED, UNKNOWN, Marker, Pose2D

SYMBOLS = {FREE: ".", OCCUPIED: "#", UNKNOWN: "?"}


def picture(world, resolution=1.0):
    """Rows of text, the largest y on top."""
    cells = rasterise(world, resolution).cells[::-1]
    return ["".join(SYMBOLS[cell] for cell in row) for row in cells.tolist()]


def room(**things):
    """A 4 x 3 m room, walls 1 m thick centred on half metres, inside bounds of 6 x 5 m."""
    corners = [[0.5, 0.5], [5.5, 0.5], [5.5, 4.5], [0.5, 4.5], [0.5, 0.5]]
    wall = Wall(np.array(corners), thickness=1.0)
    return World("test", (0.0, 0.0, 7.0, 5.0), (wall,), start=Pose2D(1.5, 1.5), **things)


def test_a_room_is_free_inside_and_unknown_outside():
    assert picture(room()) == [
        "######?",
        "#....#?",
        "#....#?",
        "#....#?",
        "######?",
    ]


def test_a_box_flush_with_cell_edges_covers_those_cells_only():
    boxed = room(boxes=(Box(Pose2D(3.0, 2.0), (2.0, 2.0, 1.0)),))
    assert picture(boxed) == ["######?", "#....#?", "#.##.#?", "#.##.#?", "######?"]


def test_a_box_that_overlaps_a_sliver_of_a_cell_covers_it():
    boxed = room(boxes=(Box(Pose2D(2.5, 2.5), (1.02, 0.5, 1.0)),))
    assert picture(boxed) == ["######?", "#....#?", "####.#?", "#....#?", "######?"]


def test_a_wall_s_corner_is_filled_and_its_free_ends_stop_at_their_points():
    bent = Wall(np.array([[1.0, 1.5], [3.5, 1.5], [3.5, 4.0]]), thickness=1.0)
    world = World("test", (0.0, 0.0, 5.0, 5.0), (bent,), start=Pose2D(0.5, 0.5))
    assert picture(world) == [".....", "...#.", "...#.", ".###.", "....."]


def test_a_turned_box_covers_a_diamond():
    # The square of side sqrt(2) turned by 45 deg has its corners 1 m from its middle, here the
    # corner that four cells share; it overlaps just these four.
    boxed = room(boxes=(Box(Pose2D(3.0, 2.0, pi / 4), (2**0.5, 2**0.5, 1.0)),))
    assert picture(boxed)[2:4] == ["#.##.#?", "#.##.#?"]


def test_a_disc_leaves_the_cells_at_its_diagonals_free():
    # Round the middle of a cell the four cells beside it begin at 0.5 m and the four at its
    # diagonals at hypot(0.5, 0.5) = 0.71 m: a radius of 0.6 m lies between the two.
    # It shuts off three corners of the room; only the one with the start is known to be free.
    assert picture(room(cylinders=(Cylinder(2.5, 2.5, 0.6),)))[1:4] == [
        "#?#??#?",
        "####?#?",
        "#.#??#?",
    ]


def test_doors_markers_and_unmapped_things_are_not_drawn():
    plain = picture(room())
    assert plain == picture(
        room(
            boxes=(Box(Pose2D(3.0, 2.0), (1.0, 1.0, 1.0), on_map=False),),
            cylinders=(Cylinder(2.5, 2.5, 0.6, on_map=False),),
            doors=(Door("d", (1.0, 2.5), (5.0, 2.5), closed=True),),
            markers=(Marker(1, 0.2, (1.01, 2.0, 0.4), 0.0),),
        )
    )


def test_a_room_without_a_way_in_is_unknown():
    across = Wall(np.array([[3.5, 1.0], [3.5, 4.0]]), thickness=1.0)
    divided = room()
    divided = World("test", divided.bounds, (*divided.walls, across), start=divided.start)
    assert picture(divided)[2] == "#..#?#?"


def test_a_start_inside_a_wall_leaves_nothing_free():
    inside = World("test", (0.0, 0.0, 7.0, 5.0), room().walls, start=Pose2D(0.5, 0.5))
    assert "." not in "".join(picture(inside))


@settings(deadline=None, max_examples=60)
@given(
    heading=st.floats(-pi, pi),
    thickness=st.floats(0.01, 0.3),
    shift=st.floats(0.0, 0.05),
)
def test_walls_at_any_angle_and_thinner_than_a_cell_are_closed(heading, thickness, shift):
    corners = Pose2D(shift, shift, heading).transform(
        np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]])
    )
    corners[-1] = corners[0]
    world = World("test", (-2.0, -2.0, 2.0, 2.0), (Wall(corners, thickness),))
    grid = rasterise(world, 0.05)
    edge = np.concatenate([grid.cells[0], grid.cells[-1], grid.cells[:, 0], grid.cells[:, -1]])
    assert (edge == UNKNOWN).all()
    # The free area is that of the inner square, less at most the cells along its 4 sides.
    side = 2.0 - thickness
    area = np.count_nonzero(grid.cells == FREE) * 0.05**2
    assert side**2 - 4 * side * 0.05 * 2**0.5 <= area <= side**2 + 1e-9


def test_too_many_cells_are_refused_with_both_numbers():
    world = World("test", (0.0, 0.0, 1000.0, 1000.0))
    with pytest.raises(ParameterError, match=r"400000000 cells of 0.05 m, at most 67108864"):
        rasterise(world, 0.05)
