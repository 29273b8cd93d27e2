"""Pictures of maps with coordinates, places and labels: `doctor`, `show world`, failed runs."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from math import ceil, floor
from pathlib import Path
from textwrap import wrap

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stack.errors import InputError
from stack.types import OccupancyGrid, Pose2D

PIXELS_PER_METRE = 120
"""Approximate scale of small maps; a cell is a whole number of pixels."""

LARGEST = 4000
"""Pixels of the longer side; larger maps have a smaller scale."""

LENGTHS = (50.0, 20.0, 10.0, 5.0, 2.0, 1.0, 0.5)
"""Possible lengths of the scale bar, metres."""

FOOTER, LINE, LETTER = 44, 20, 9
"""Pixels: below the map, for the title and the scale; height of a line of the title, and width of
a letter."""

Colour = tuple[int, int, int]
OUTSIDE: Colour = (10, 10, 10)
GROUND: Colour = (34, 21, 13)
WALL: Colour = (193, 165, 147)
TEXT: Colour = (234, 214, 201)
GRID: Colour = (66, 50, 38)
"""Colours: blue, green, red."""


class MapPicture:
    """A map as an image, to which markers and labels are added."""

    def __init__(self, grid: OccupancyGrid) -> None:
        import cv2

        self._cv2, self._grid = cv2, grid
        most = max(1, LARGEST // max(grid.cells.shape))
        self._scale = min(max(1, round(PIXELS_PER_METRE * grid.resolution)), most)
        self._cells = np.full((*grid.cells.shape, 3), OUTSIDE, dtype=np.uint8)
        self.fill(grid.free, GROUND)
        self.fill(grid.occupied, WALL)
        self._image = self._cells

    def fill(self, cells: NDArray[np.bool_], colour: Colour) -> None:
        """Colour cells; only before `begin`."""
        self._cells[cells] = colour

    def begin(self) -> None:
        """Enlarge the cells to pixels, draw coordinates; markers can be drawn from now on."""
        cells = np.ascontiguousarray(np.flipud(self._cells))
        self._image = self._cv2.resize(
            cells, None, fx=self._scale, fy=self._scale, interpolation=self._cv2.INTER_NEAREST
        )
        self._draw_coordinates()

    def _draw_coordinates(self) -> None:
        """Draw lines of equal x and of equal y, and write their coordinates at the border."""
        cv2, length, (rows, columns) = self._cv2, self._length, self._image.shape[:2]
        x_min, y_min = self._grid.origin[:2]
        width, height = (size * self._grid.resolution for size in self._grid.cells.shape[::-1])
        for x in _multiples(length, x_min, x_min + width):
            column = self.pixel(x, y_min)[0]
            cv2.line(self._image, (column, 0), (column, rows), GRID, 1)
            self._write(f"{x:g}", (column + 4, rows - 6), WALL)
        for y in _multiples(length, y_min, y_min + height):
            row = self.pixel(x_min, y)[1]
            cv2.line(self._image, (0, row), (columns, row), GRID, 1)
            self._write(f"{y:g}", (4, row - 4), WALL)

    @property
    def _length(self) -> float:
        """Length of the scale bar and of a square of the coordinates, metres."""
        widest = self._image.shape[1] / 4
        return next((metres for metres in LENGTHS if self.pixels(metres) <= widest), LENGTHS[-1])

    def pixel(self, x: float, y: float) -> tuple[int, int]:
        """Column and row of a point in the world frame, metres."""
        column = (x - self._grid.origin[0]) / self._grid.resolution
        row = self._grid.cells.shape[0] - (y - self._grid.origin[1]) / self._grid.resolution
        return round(column * self._scale), round(row * self._scale)

    def pixels(self, metres: float) -> int:
        """Length in pixels."""
        pixels: float = metres / self._grid.resolution * self._scale
        return round(pixels)

    def circle(self, x: float, y: float, radius: float, colour: Colour) -> None:
        """Draw a circle; radius in metres."""
        cv2 = self._cv2
        least = max(4, self.pixels(radius))
        cv2.circle(self._image, self.pixel(x, y), least, colour, 2, cv2.LINE_AA)

    def dot(self, x: float, y: float, colour: Colour) -> None:
        """Draw a dot of a few pixels."""
        self._cv2.circle(self._image, self.pixel(x, y), 2, colour, -1)

    def line(self, points: ArrayLike, colour: Colour) -> None:
        """Draw a line through points (n, 2), world frame, metres."""
        pixels = np.array([self.pixel(x, y) for x, y in np.asarray(points).tolist()], np.int32)
        self._cv2.polylines(self._image, [pixels], False, colour, 2, self._cv2.LINE_AA)

    def place(self, name: str, pose: Pose2D, colour: Colour = TEXT) -> None:
        """Draw a named pose: a cross, a line in its heading, and its name."""
        cv2, at = self._cv2, self.pixel(pose.x, pose.y)
        tip = self.pixel(pose.x + 0.3 * np.cos(pose.heading), pose.y + 0.3 * np.sin(pose.heading))
        cv2.drawMarker(self._image, at, colour, cv2.MARKER_CROSS, 12, 2)
        cv2.line(self._image, at, tip, colour, 1, cv2.LINE_AA)
        self.label(name, pose.x, pose.y, colour)

    def label(self, text: str, x: float, y: float, colour: Colour = TEXT) -> None:
        """Write beside a point, on a dark outline, inside the picture."""
        cv2, (column, row) = self._cv2, self.pixel(x, y)
        (width, height), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 1)
        rows, columns = self._image.shape[:2]
        column = min(max(0, column + 8), max(0, columns - width - 4))
        self._write(text, (column, min(max(height + 4, row - 6), rows - 4)), colour)

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """The picture, (rows, columns, 3) uint8 RGB."""
        return np.ascontiguousarray(self._image[..., ::-1])

    def copy(self) -> MapPicture:
        """Return a copy, to which other markers can be added."""
        other = copy(self)
        other._image = self._image.copy()
        return other

    def save(self, path: Path, title: str) -> None:
        """Write the picture with a title and a scale bar below the map.

        Raises:
            InputError: the picture cannot be written.
        """
        columns = self._image.shape[1]
        metres = self._length
        lines = wrap(title, max(20, (columns - self.pixels(metres) - 40) // LETTER))
        height = FOOTER + LINE * (len(lines) - 1)
        row = self._image.shape[0] + FOOTER // 2
        footer = np.full((height, columns, 3), OUTSIDE, dtype=np.uint8)
        self._image = np.vstack([self._image, footer])
        left, right = columns - 16 - self.pixels(metres), columns - 16
        cv2 = self._cv2
        cv2.line(self._image, (left, row + 8), (right, row + 8), TEXT, 2)
        for column in (left, right):
            cv2.line(self._image, (column, row + 3), (column, row + 13), TEXT, 2)
        self._write(f"{metres:g} m", (left, row - 4), TEXT)
        for number, line in enumerate(lines):
            self._write(line, (12, row + 6 + LINE * number), TEXT)
        if path.suffix != ".png" or not cv2.imwrite(str(path), self._image):
            raise InputError(f"cannot write the picture {path}; the name must end in .png")

    def _write(self, text: str, at: tuple[int, int], colour: Colour) -> None:
        cv2 = self._cv2
        for shade, thickness in ((OUTSIDE, 4), (colour, 1)):
            cv2.putText(
                self._image, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, shade, thickness, cv2.LINE_AA
            )


def _multiples(length: float, least: float, most: float) -> list[float]:
    """Return the multiples of a length between two numbers."""
    return [n * length for n in range(ceil(least / length), floor(most / length) + 1)]


def draw_world(path: Path, grid: OccupancyGrid, places: Mapping[str, Pose2D], title: str) -> None:
    """Draw a map with its places.

    Raises:
        InputError: the picture cannot be written.
    """
    picture = MapPicture(grid)
    picture.begin()
    for name, pose in places.items():
        picture.place(name, pose)
    picture.save(path, title)
