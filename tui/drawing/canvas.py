"""Map as characters: walls as quadrant blocks, costs as half blocks, overlays as braille dots.

Arrays only, no widgets. A character cell has 2 × 4 braille dots; a dot is square.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from rich.cells import get_character_cell_size

from stack.types import (
    FREE,
    FREE_COST,
    LETHAL_COST,
    UNKNOWN,
    UNKNOWN_COST,
    CostGrid,
    FloatArray,
    OccupancyGrid,
    Pose2D,
)
from tui.drawing import palette

QUADRANTS = np.array([ord(glyph) for glyph in " ▘▝▀▖▌▞▛▗▚▐▜▄▙▟█"], dtype=np.uint32)
BRAILLE = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.uint32)
HALF_BLOCK = ord("▀")
RAMP = np.array(
    [palette.blend(palette.COST_LOW, palette.COST_HIGH, level / 15) for level in range(16)],
    dtype=np.uint32,
)


@dataclass(frozen=True, slots=True)
class View:
    """Visible part of the map: centre (metres, map frame) and size of a braille dot (metres)."""

    x: float
    y: float
    metres_per_dot: float

    @staticmethod
    def fitting(grid: OccupancyGrid, columns: int, rows: int) -> View:
        """Return the view of the whole map, with a small margin."""
        height, width = (side * grid.resolution for side in grid.cells.shape)
        scale = max(width / max(1, columns * 2 - 4), height / max(1, rows * 4 - 4), 0.005)
        return View(grid.origin[0] + width / 2, grid.origin[1] + height / 2, scale)

    @staticmethod
    def about(pose: Pose2D, radius: float, columns: int, rows: int) -> View:
        """Return the view of a circle about a pose, its radius in metres."""
        scale = 2.0 * radius / max(1, min(columns * 2, rows * 4) - 4)
        return View(0.0, 0.0, scale).centred(pose)

    @staticmethod
    def around(pose: Pose2D, columns: int, span: float = 12.0) -> View:
        """Return a view `span` metres wide, centred on the pose."""
        return View(0.0, 0.0, span / max(1, columns * 2)).centred(pose)

    def centred(self, pose: Pose2D) -> View:
        """Return the view centred on the pose, to whole characters: walls keep their shape."""
        across, down = 2 * self.metres_per_dot, 4 * self.metres_per_dot
        return replace(self, x=round(pose.x / across) * across, y=round(pose.y / down) * down)

    def zoomed(self, factor: float) -> View:
        """Return the view zoomed in by a factor."""
        scale = min(1.0, max(0.005, self.metres_per_dot / factor))
        return replace(self, metres_per_dot=scale)

    def point(self, column: int, row: int, columns: int, rows: int) -> tuple[float, float]:
        """Return the map point (x, y), metres, at the centre of a character."""
        dot = self.metres_per_dot
        return self.x + (2 * column + 1 - columns) * dot, self.y - (4 * row + 2 - 2 * rows) * dot

    def dots(self, points: FloatArray, columns: int, rows: int) -> NDArray[np.int64]:
        """Return the braille dots (n, 2), as column and row, of map points (n, 2), metres.

        Dots may be outside the canvas.
        """
        scaled = np.empty((len(points), 2))
        scaled[:, 0] = (points[:, 0] - self.x) / self.metres_per_dot + columns
        scaled[:, 1] = (self.y - points[:, 1]) / self.metres_per_dot + rows * 2
        return np.floor(scaled).astype(np.int64)


class Canvas:
    """A frame of characters: a code point and two packed colours per cell."""

    def __init__(self, view: View, columns: int, rows: int) -> None:
        self.view, self.columns, self.rows = view, columns, rows
        shape = (rows, columns)
        self.glyphs = np.full(shape, HALF_BLOCK, dtype=np.uint32)
        self.foreground = np.full(shape, palette.UNKNOWN, dtype=np.uint32)
        self.background = np.full(shape, palette.UNKNOWN, dtype=np.uint32)
        self._walls = np.zeros(shape, dtype=bool)
        self._words = np.zeros(shape, dtype=bool)
        self._dots = np.zeros(shape, dtype=np.uint32)

    def copy(self) -> Canvas:
        """Return a copy to draw overlays on, with the positions of walls and words."""
        other = Canvas(self.view, self.columns, self.rows)
        other.glyphs[:], other.foreground[:] = self.glyphs, self.foreground
        other.background[:] = self.background
        other._walls, other._words = self._walls, self._words.copy()
        return other

    def draw_costs(self, grid: OccupancyGrid | None, costs: CostGrid | None) -> None:
        """Draw free, unknown and costly cells, two samples per character."""
        x, y = self._sample_points(1, 2)
        unknown = np.zeros((self.rows * 2, self.columns), dtype=bool)
        occupied = np.zeros_like(unknown)
        if grid is not None:
            occupancy = _look_up(grid, x, y, UNKNOWN)
            occupied = grid.are_occupied(occupancy)
            unknown = ~occupied & ~grid.are_free(occupancy)
        colours = np.where(unknown, palette.UNKNOWN, palette.FREE).astype(np.uint32)
        if costs is not None:
            value = _look_up(costs, x, y, FREE_COST)
            costly = (value > FREE_COST) & (value < UNKNOWN_COST) & ~unknown
            colours[costly] = RAMP[np.minimum(value[costly] // 17, 15)]
            colours[(value == LETHAL_COST) & ~occupied & ~unknown] = palette.SENSED
        self.foreground[:], self.background[:] = colours[0::2], colours[1::2]

    def draw_walls(self, grid: OccupancyGrid) -> None:
        """Draw occupied cells as quadrants, pooled so that thin walls stay visible at any zoom."""
        x, y = self._sample_points(2, 2)
        filled = grid.are_occupied(_look_up(grid, x, y, FREE))
        row, column = np.nonzero(grid.occupied)
        centres = np.column_stack([column, row]) + 0.5
        points = centres * grid.resolution + np.array(grid.origin)
        dots = self.view.dots(points, self.columns, self.rows)
        quad_column, quad_row = dots[:, 0], dots[:, 1] // 2
        inside = (
            (quad_column >= 0) & (quad_column < self.columns * 2)
            & (quad_row >= 0) & (quad_row < self.rows * 2)
        )  # fmt: skip
        filled[quad_row[inside], quad_column[inside]] = True
        mask = (
            filled[0::2, 0::2] | filled[0::2, 1::2] << 1
            | filled[1::2, 0::2] << 2 | filled[1::2, 1::2] << 3
        )  # fmt: skip
        self._walls = mask > 0
        # Where the upper half is free, the background next to the wall is the upper floor sample.
        upper_open = self._walls & (mask & 0b0011 == 0)
        self.background[upper_open] = self.foreground[upper_open]
        self.glyphs[self._walls] = QUADRANTS[mask[self._walls]]
        self.foreground[self._walls] = palette.WALL

    def draw_points(self, points: FloatArray, colour: int, *, below_words: bool = False) -> None:
        """Draw map points (n, 2), metres, as braille dots. A later colour recolours the cell."""
        cell_row, cell_column, bits = self._cells_of(points)
        if below_words:
            seen = ~self._words[cell_row, cell_column]
            cell_row, cell_column, bits = cell_row[seen], cell_column[seen], bits[seen]
        at = (cell_row, cell_column)
        other = self.foreground[at] != colour
        self._dots[cell_row[other], cell_column[other]] = 0
        np.bitwise_or.at(self._dots, at, bits)
        self.background[at] = np.where(self._walls[at], palette.WALL_DIM, self.background[at])
        self.glyphs[at] = 0x2800 + self._dots[at]
        self.foreground[at] = colour

    def draw_hits(self, points: FloatArray, colour: int, wall_colour: int) -> None:
        """Draw scan end points (n, 2), metres: highlight walls at them, else draw dots."""
        cell_row, cell_column, _ = self._cells_of(points)
        explained = self._walls[cell_row, cell_column]
        glowing = (cell_row[explained], cell_column[explained])
        self.foreground[glowing] = np.where(
            self.glyphs[glowing] < 0x2800, wall_colour, self.foreground[glowing]
        )
        dots = self.view.dots(points, self.columns, self.rows)
        inside = self._inside(dots)
        self.draw_points(points[inside][~explained], colour)

    def draw_line(self, points: FloatArray, colour: int, *, below_words: bool = False) -> None:
        """Draw a polyline (n, 2), metres, as braille dots without gaps."""
        if len(points) < 2:
            return
        steps = np.diff(points, axis=0)
        counts = np.ceil(np.abs(steps).max(axis=1) / self.view.metres_per_dot).astype(int) + 1
        piece = np.repeat(np.arange(len(steps)), counts)
        first = np.repeat(np.cumsum(counts) - counts, counts)
        share = (np.arange(len(piece)) - first) / np.maximum(counts[piece] - 1, 1)
        dense = points[:-1][piece] + steps[piece] * share[:, None]
        self.draw_points(dense, colour, below_words=below_words)

    def draw_text(
        self, x: float, y: float, text: str, colour: int, back: int | None = None
    ) -> None:
        """Draw a text whose first character is at a map point, metres."""
        row, column = self._cell_at(x, y)
        if 0 <= row < self.rows:
            self._write(row, column, text, colour, back)

    def draw_place(self, x: float, y: float, name: str, colour: int) -> None:
        """Draw a ring at a map point, with its name beside, above or below it if there is room."""
        row, column = self._cell_at(x, y)
        if not self._is_free(row, column, 1):
            return
        self._write(row, column, "◦", colour, None)
        middle = column - len(name) // 2
        for at_row, at_column in (
            (row, column + 1), (row, column - len(name)), (row + 1, middle), (row - 1, middle),
        ):  # fmt: skip
            if self._is_free(at_row, at_column, len(name)):
                self._write(at_row, at_column, name, colour, None)
                return

    def _write(self, row: int, column: int, text: str, colour: int, back: int | None) -> None:
        for offset, glyph in enumerate(text):
            if 0 <= column + offset < self.columns:
                at = (row, column + offset)
                if back is not None:
                    self.background[at] = back
                elif self._walls[at]:
                    self.background[at] = palette.WALL_DIM
                shown = glyph if get_character_cell_size(glyph) == 1 else "?"  # one per cell
                self.glyphs[at], self.foreground[at] = ord(shown), colour
                self._words[at] = True

    def _is_free(self, row: int, column: int, length: int) -> bool:
        if not (0 <= row < self.rows and 0 <= column and column + length <= self.columns):
            return False
        cells = (row, slice(column, column + length))
        return not (self._walls[cells].any() or self._words[cells].any())

    def _cell_at(self, x: float, y: float) -> tuple[int, int]:
        column, row = self.view.dots(np.array([[x, y]]), self.columns, self.rows)[0]
        return int(row) // 4, int(column) // 2

    def _inside(self, dots: NDArray[np.int64]) -> NDArray[np.bool_]:
        column, row = dots[:, 0], dots[:, 1]
        within: NDArray[np.bool_] = (
            (column >= 0) & (column < self.columns * 2) & (row >= 0) & (row < self.rows * 4)
        )
        return within

    def _cells_of(
        self, points: FloatArray
    ) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.uint32]]:
        """Return row, column and braille bit of the points inside the canvas."""
        dots = self.view.dots(points, self.columns, self.rows)
        dots = dots[self._inside(dots)]
        column, row = dots[:, 0], dots[:, 1]
        return row // 4, column // 2, BRAILLE[row % 4, column % 2]

    def _sample_points(self, across: int, down: int) -> tuple[FloatArray, FloatArray]:
        """Return map x (1, n) and y (m, 1) of the centres of across × down samples per cell."""
        dot = self.view.metres_per_dot
        column = (np.arange(self.columns * across, dtype=np.float64) + 0.5) * (2 / across)
        row = (np.arange(self.rows * down, dtype=np.float64) + 0.5) * (4 / down)
        x: FloatArray = self.view.x + (column - self.columns) * dot
        y: FloatArray = self.view.y - (row - self.rows * 2) * dot
        return x[None, :], y[:, None]


def scale_bar(view: View, at_most: int) -> tuple[int, float]:
    """Return characters and metres of the longest bar of round length; (0, 0.0) if none fits."""
    for metres in (50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5, 0.2, 0.1):
        characters = round(metres / (2 * view.metres_per_dot))
        if 2 <= characters <= at_most:
            return characters, metres
    return 0, 0.0


def circle(x: float, y: float, radius: float) -> FloatArray:
    """Return the points (25, 2) of a closed circle."""
    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    return np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])


def arrow(pose: Pose2D) -> str:
    """Return the arrow glyph nearest to the heading."""
    return "→↗↑↖←↙↓↘"[round(pose.heading / (np.pi / 4)) % 8]


def _look_up(
    grid: OccupancyGrid | CostGrid, x: FloatArray, y: FloatArray, outside: int
) -> NDArray[np.int64]:
    """Return the grid's values (m, n) at x (1, n) and y (m, 1), metres; `outside` elsewhere."""
    column = np.floor((x - grid.origin[0]) / grid.resolution).astype(np.int64)
    row = np.floor((y - grid.origin[1]) / grid.resolution).astype(np.int64)
    rows, columns = grid.cells.shape
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    values = grid.cells[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
    return np.where(inside, values, outside).astype(np.int64)
