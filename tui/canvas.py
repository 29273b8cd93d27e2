"""The map as characters: walls as quadrant blocks, costs as half blocks, the rest as braille.

Pure arrays; no widget in sight. A character cell is 2 × 4 braille dots, and a dot is square.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stack.types import CostGrid, FloatArray, OccupancyGrid, Pose2D
from tui import palette

QUADRANTS = np.array([ord(glyph) for glyph in " ▘▝▀▖▌▞▛▗▚▐▜▄▙▟█"], dtype=np.uint32)
BRAILLE = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.uint32)
HALF_BLOCK = ord("▀")
RAMP = np.array(
    [palette.blend(palette.COST_LOW, palette.COST_HIGH, level / 15) for level in range(16)],
    dtype=np.uint32,
)


@dataclass(frozen=True, slots=True)
class View:
    """Which part of the map is shown: the middle (metres) and the size of a braille dot."""

    x: float
    y: float
    metres_per_dot: float

    @staticmethod
    def fitting(grid: OccupancyGrid, columns: int, rows: int) -> View:
        """The whole map, with a little air around it."""
        height, width = (side * grid.resolution for side in grid.cells.shape)
        scale = max(width / max(1, columns * 2 - 4), height / max(1, rows * 4 - 4), 0.005)
        return View(grid.origin[0] + width / 2, grid.origin[1] + height / 2, scale)

    def zoomed(self, factor: float) -> View:
        """Nearer by a factor."""
        return replace(
            self, metres_per_dot=float(np.clip(self.metres_per_dot / factor, 0.005, 1.0))
        )

    def dots(self, points: FloatArray, columns: int, rows: int) -> NDArray[np.int64]:
        """Braille dot (column, row) of map points (n, 2); may lie outside."""
        scaled = np.empty((len(points), 2))
        scaled[:, 0] = (points[:, 0] - self.x) / self.metres_per_dot + columns
        scaled[:, 1] = (self.y - points[:, 1]) / self.metres_per_dot + rows * 2
        return np.floor(scaled).astype(np.int64)


class Canvas:
    """A frame of characters being drawn."""

    def __init__(self, view: View, columns: int, rows: int) -> None:
        self.view, self.columns, self.rows = view, columns, rows
        shape = (rows, columns)
        self.glyphs = np.full(shape, HALF_BLOCK, dtype=np.uint32)
        self.foreground = np.full(shape, palette.UNKNOWN, dtype=np.uint32)
        self.background = np.full(shape, palette.UNKNOWN, dtype=np.uint32)
        self._walls = np.zeros(shape, dtype=bool)
        self._dots = np.zeros(shape, dtype=np.uint32)

    def copy(self) -> Canvas:
        """The same frame, to draw overlays on."""
        other = Canvas.__new__(Canvas)
        other.view, other.columns, other.rows = self.view, self.columns, self.rows
        other.glyphs, other.foreground = self.glyphs.copy(), self.foreground.copy()
        other.background, other._walls = self.background.copy(), self._walls
        other._dots = np.zeros_like(self._dots)
        return other

    def draw_costs(self, grid: OccupancyGrid, costs: CostGrid | None) -> None:
        """Free, unknown and costly floor, two samples a character."""
        x, y = self._sample_points(1, 2)
        occupancy = _look_up(grid, x, y, -1)
        colours = np.where(occupancy < 0, palette.UNKNOWN, palette.FREE).astype(np.uint32)
        if costs is not None:
            value = _look_up(costs, x, y, 0)
            costly = (value > 0) & (value < 255) & (occupancy >= 0)
            colours[costly] = RAMP[np.minimum(value[costly].astype(np.int64) // 17, 15)]
            colours[(value == 254) & (occupancy == 0)] = palette.SENSED
        self.foreground[:], self.background[:] = colours[0::2], colours[1::2]

    def draw_walls(self, grid: OccupancyGrid) -> None:
        """Occupied cells as quadrants, pooled so that thin walls survive any zoom."""
        x, y = self._sample_points(2, 2)
        filled = _look_up(grid, x, y, 0) == 100
        row, column = np.nonzero(grid.cells == 100)
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
        floor = self.background[self._walls]
        self.glyphs[self._walls] = QUADRANTS[mask[self._walls]]
        self.foreground[self._walls] = palette.WALL
        self.background[self._walls] = floor

    def draw_points(self, points: FloatArray, colour: int) -> None:
        """Map points (n, 2) as braille dots; later colours win a character."""
        dots = self.view.dots(points, self.columns, self.rows)
        column, row = dots[:, 0], dots[:, 1]
        inside = (column >= 0) & (column < self.columns * 2) & (row >= 0) & (row < self.rows * 4)
        column, row = column[inside], row[inside]
        cell_row, cell_column = row // 4, column // 2
        np.bitwise_or.at(self._dots, (cell_row, cell_column), BRAILLE[row % 4, column % 2])
        at = (cell_row, cell_column)
        wall = self._walls[at]
        self.background[at] = np.where(wall, palette.WALL_DIM, self.background[at])
        self.glyphs[at] = 0x2800 + self._dots[at]
        self.foreground[at] = colour

    def draw_line(self, points: FloatArray, colour: int) -> None:
        """A polyline (n, 2) as braille dots, densely enough to have no holes."""
        if len(points) < 2:
            return
        steps = np.diff(points, axis=0)
        counts = np.ceil(np.abs(steps).max(axis=1) / self.view.metres_per_dot).astype(int) + 1
        pieces = [
            start + step * np.linspace(0.0, 1.0, count)[:, None]
            for start, step, count in zip(points[:-1], steps, counts, strict=True)
        ]
        self.draw_points(np.vstack(pieces), colour)

    def draw_text(
        self, x: float, y: float, text: str, colour: int, back: int | None = None
    ) -> None:
        """A word whose first character sits at a map point; walls under it stay dimmed."""
        dot_column, dot_row = self.view.dots(np.array([[x, y]]), self.columns, self.rows)[0]
        row, column = int(dot_row // 4), int(dot_column // 2)
        if not 0 <= row < self.rows:
            return
        for offset, glyph in enumerate(text):
            if 0 <= column + offset < self.columns:
                at = (row, column + offset)
                if self._walls[at] and back is None:
                    self.background[at] = palette.WALL_DIM
                elif back is not None:
                    self.background[at] = back
                self.glyphs[at], self.foreground[at] = ord(glyph), colour

    def is_free(self, x: float, y: float, length: int) -> bool:
        """Whether a word of this length at a map point would cover no wall and no drawing."""
        dot_column, dot_row = self.view.dots(np.array([[x, y]]), self.columns, self.rows)[0]
        row, column = int(dot_row // 4), int(dot_column // 2)
        if not (0 <= row < self.rows and 0 <= column and column + length <= self.columns):
            return False
        cells = (row, slice(column, column + length))
        return not self._walls[cells].any()

    def _sample_points(self, across: int, down: int) -> tuple[FloatArray, FloatArray]:
        """Map x (1, n) and y (m, 1) of the middles of across × down samples a character."""
        dot = self.view.metres_per_dot
        column = (np.arange(self.columns * across) + 0.5) * (2 / across)
        row = (np.arange(self.rows * down) + 0.5) * (4 / down)
        x = self.view.x + (column - self.columns) * dot
        y = self.view.y - (row - self.rows * 2) * dot
        return x[None, :], y[:, None]


def circle(x: float, y: float, radius: float) -> FloatArray:
    """(25, 2) points of a circle, closed."""
    angles = np.linspace(0.0, 2.0 * np.pi, 25)
    return np.column_stack([x + radius * np.cos(angles), y + radius * np.sin(angles)])


def arrow(pose: Pose2D) -> str:
    """The arrow glyph nearest to a heading."""
    return "→↗↑↖←↙↓↘"[round(pose.heading / (np.pi / 4)) % 8]


def _look_up(
    grid: OccupancyGrid | CostGrid, x: FloatArray, y: FloatArray, outside: int
) -> NDArray[np.int64]:
    """Values of the grid at every (y, x) of the outer product."""
    column = np.floor((x - grid.origin[0]) / grid.resolution).astype(np.int64)
    row = np.floor((y - grid.origin[1]) / grid.resolution).astype(np.int64)
    rows, columns = grid.cells.shape
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    values = grid.cells[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)]
    return np.where(inside, values, outside).astype(np.int64)
