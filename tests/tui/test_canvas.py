"""Dots and blocks by hand: a character is 2 x 4 dots, row 0 of a map is drawn at the bottom."""

import numpy as np
import pytest

from stack.types import CostGrid, OccupancyGrid, Pose2D
from tui.drawing import palette
from tui.drawing.canvas import Canvas, View, arrow, circle, scale_bar


def empty_map(rows=40, columns=40, resolution=0.1):
    return OccupancyGrid(np.zeros((rows, columns), dtype=np.int8), resolution)


def walls_of(canvas):
    """Characters that show a wall: (row, column) -> glyph."""
    rows, columns = np.nonzero(canvas.foreground == palette.WALL)
    return {
        (int(row), int(column)): chr(canvas.glyphs[row, column])
        for row, column in zip(rows, columns, strict=True)
    }


def drawn(grid, view, columns=20, rows=10):
    canvas = Canvas(view, columns, rows)
    canvas.draw_costs(grid, None)
    canvas.draw_walls(grid)
    return canvas


def test_a_block_fills_the_characters_it_covers():
    # 4 m x 4 m, 20 x 10 characters of 2 x 4 dots of 0.1 m: one map cell is one dot.
    grid = empty_map()
    grid.cells[0:4, 0:2] = 100  # the corner at the smallest x and y: one whole character
    canvas = drawn(grid, View(2.0, 2.0, 0.1))
    assert walls_of(canvas) == {(9, 0): "█"}


def test_row_zero_is_drawn_at_the_bottom():
    grid = empty_map()
    grid.cells[0, 20] = 100
    grid.cells[39, 20] = 100
    assert {row for row, _ in walls_of(drawn(grid, View(2.0, 2.0, 0.1)))} == {0, 9}


@pytest.mark.parametrize(
    ("scale", "row", "column"),
    [
        # The cell's middle is 1.05 m right of and 0.95 m above the view's middle:
        # dots (20 + 1.05 / scale, 20 - 0.95 / scale), 2 and 4 of them a character.
        (0.1, (20 - 9.5) // 4, (20 + 10.5) // 2),
        (0.2, (20 - 4.75) // 4, (20 + 5.25) // 2),
        (0.06, (20 - 0.95 / 0.06) // 4, (20 + 1.05 / 0.06) // 2),
    ],
)
def test_a_wall_appears_in_its_character_at_any_zoom(scale, row, column):
    grid = empty_map()
    grid.cells[29, 30] = 100  # middle at x 3.05, y 2.95
    assert (int(row), int(column)) in walls_of(drawn(grid, View(2.0, 2.0, scale)))


@pytest.mark.parametrize("scale", [0.1, 0.2, 0.5, 1.0])
def test_a_thin_wall_survives_zooming_out(scale):
    # A vertical wall one 5 cm cell thick through a map of 20 m.
    grid = empty_map(400, 400, 0.05)
    grid.cells[:, 137] = 100
    canvas = drawn(grid, View(10.0, 10.0, scale), 100, 50)
    covered = {row for row, _ in walls_of(canvas)}
    assert len(covered) >= int(20.0 / scale) // 4 or len(covered) == 50
    assert len({column for _, column in walls_of(canvas)}) == 1


def test_a_quadrant_is_the_quarter_of_the_character_that_is_occupied():
    grid = empty_map()
    grid.cells[2:4, 1] = 100  # upper right quarter of the bottom left character
    assert walls_of(drawn(grid, View(2.0, 2.0, 0.1))) == {(9, 0): "▝"}


def test_beside_a_wall_in_the_lower_half_shows_the_floor_of_the_upper_half():
    grid = empty_map()
    grid.cells[0:2, 0:2] = 100
    costs = CostGrid(np.zeros((40, 40), dtype=np.uint8), 0.1)
    costs.cells[0:2, 0:2] = 254
    canvas = Canvas(View(2.0, 2.0, 0.1), 20, 10)
    canvas.draw_costs(grid, costs)
    canvas.draw_walls(grid)
    assert walls_of(canvas) == {(9, 0): "▄"}
    assert canvas.background[9, 0] == palette.FREE


@pytest.mark.parametrize(
    ("column", "row", "glyph"),
    # Unicode braille: dots 1-2-3-7 down the left side, 4-5-6-8 down the right.
    [(0, 0, "⠁"), (0, 1, "⠂"), (0, 2, "⠄"), (0, 3, "⡀"), (1, 0, "⠈"), (1, 3, "⢀")],
)
def test_dots_stand_where_unicode_puts_them(column, row, glyph):
    canvas = Canvas(View(2.0, 2.0, 0.1), 20, 10)
    canvas.draw_points(np.array([[(column + 0.5) * 0.1, 4.0 - (row + 0.5) * 0.1]]), palette.PATH)
    assert chr(canvas.glyphs[0, 0]) == glyph


def test_dots_of_one_colour_share_a_character_and_another_colour_takes_it():
    canvas = Canvas(View(2.0, 2.0, 0.1), 20, 10)
    canvas.draw_points(np.array([[0.05, 3.95], [0.15, 3.95]]), palette.TRAIL)
    assert chr(canvas.glyphs[0, 0]) == "⠉"
    canvas.draw_points(np.array([[0.05, 3.65]]), palette.PATH)
    assert chr(canvas.glyphs[0, 0]) == "⡀"
    assert canvas.foreground[0, 0] == palette.PATH


def test_points_outside_are_left_out():
    canvas = Canvas(View(2.0, 2.0, 0.1), 20, 10)
    canvas.draw_points(np.array([[-1.0, 1.0], [1.0, 99.0], [4.01, 1.0]]), palette.PATH)
    assert not (canvas.foreground == palette.PATH).any()


def test_a_line_has_no_holes():
    canvas = Canvas(View(2.0, 2.0, 0.1), 20, 10)
    canvas.draw_line(np.array([[0.01, 2.0], [3.99, 2.0]]), palette.PATH)
    assert (canvas.foreground == palette.PATH).any(axis=0).all()


def test_a_scan_makes_its_walls_glow_and_shows_the_rest_as_dots():
    grid = empty_map()
    grid.cells[0:4, 0:2] = 100
    canvas = drawn(grid, View(2.0, 2.0, 0.1)).copy()
    canvas.draw_hits(np.array([[0.1, 0.1], [2.0, 2.0]]), palette.SCAN, palette.WALL_SEEN)
    assert chr(canvas.glyphs[9, 0]) == "█" and canvas.foreground[9, 0] == palette.WALL_SEEN
    assert (canvas.foreground == palette.SCAN).sum() == 1


def test_costs_are_shown_two_a_character_and_get_dearer_in_colour():
    grid = empty_map()
    costs = CostGrid(np.zeros((40, 40), dtype=np.uint8), 0.1)
    costs.cells[0:2, 0:2] = 253  # lower half of the bottom left character
    canvas = Canvas(View(2.0, 2.0, 0.1), 20, 10)
    canvas.draw_costs(grid, costs)
    assert canvas.foreground[9, 0] == palette.FREE
    assert canvas.background[9, 0] == palette.blend(palette.COST_LOW, palette.COST_HIGH, 14 / 15)


def test_a_name_covers_neither_walls_nor_other_names():
    grid = empty_map()
    grid.cells[20:24, 24:28] = 100  # right of the place
    canvas = drawn(grid, View(2.0, 2.0, 0.1))
    walls = walls_of(canvas)
    canvas.draw_place(2.25, 2.1, "dock", palette.PLACE)
    assert walls_of(canvas) == walls
    assert "".join(map(chr, canvas.glyphs[4, 7:12])) == "dock◦"
    canvas.draw_place(2.25, 2.1, "twin", palette.PLACE)
    assert "".join(map(chr, canvas.glyphs[4, 7:12])) == "dock◦"


def test_a_trail_runs_below_names():
    canvas = drawn(empty_map(), View(2.0, 2.0, 0.1))
    canvas.draw_place(1.0, 2.0, "dock", palette.PLACE)
    over = canvas.copy()
    over.draw_line(np.array([[0.0, 1.99], [4.0, 1.99]]), palette.TRAIL, below_words=True)
    assert "".join(map(chr, over.glyphs[5, 5:10])) == "◦dock"
    assert over.foreground[5, 12] == palette.TRAIL


def test_a_fitting_view_shows_every_cell():
    grid = empty_map(30, 200, 0.05)
    grid.cells[0, 0] = grid.cells[-1, -1] = grid.cells[0, -1] = grid.cells[-1, 0] = 100
    for columns, rows in ((30, 10), (48, 15), (110, 40)):
        assert len(walls_of(drawn(grid, View.fitting(grid, columns, rows), columns, rows))) >= 4


def test_a_view_follows_by_whole_characters():
    view = View(0.0, 0.0, 0.05)
    assert view.centred(Pose2D(1.02, 1.02)) == view.centred(Pose2D(1.04, 1.04))
    assert view.centred(Pose2D(1.02, 1.02)).x == pytest.approx(1.0)


def test_the_scale_bar_is_a_round_length():
    # A character is 0.2 m wide: 2 m are ten of them, 5 m would be 25.
    assert scale_bar(View(0, 0, 0.1), 12) == (10, 2.0)
    assert scale_bar(View(0, 0, 1.0), 1) == (0, 0.0)


@pytest.mark.parametrize(
    ("heading", "glyph"), [(0.0, "→"), (np.pi / 2, "↑"), (np.pi, "←"), (-np.pi / 4, "↘")]
)
def test_arrows_point_along_the_heading(heading, glyph):
    assert arrow(Pose2D(0.0, 0.0, heading)) == glyph


def test_a_circle_is_closed_and_round():
    points = circle(1.0, 2.0, 0.5)
    assert np.allclose(points[0], points[-1])
    assert np.allclose(np.hypot(*(points - (1.0, 2.0)).T), 0.5)
