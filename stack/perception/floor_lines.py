"""Lines on the floor from camera pictures.

Each picture is rectified to a view of the floor from above (a homography: the floor is a plane and
the camera's mount is known), segmented there, and painted into a grid in the odom frame that moves
with the robot. So the line below and behind the robot, where no camera looks, is known, and gaps
and junctions are seen as a whole.

A dark line is found by its contrast against what surrounds it: the black top-hat transform of the
logarithm of the brightness (J. Serra, "Image Analysis and Mathematical Morphology", 1982), a light
one by the white top-hat. Twice the light on floor and line adds the same to both logarithms, so
the threshold is a ratio and holds in dim and bright light. Coloured lines are found by their hue.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, sin

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.perception.hues import has_hue
from stack.perception.rolling_grid import shifted
from stack.types import CameraModel, FloatArray, FloorLines, Image, LineColour, Pose2D

CELL = 0.01
"""Side of a cell, metres."""

HALF = 2.4
"""Metres from the middle of the grid to its sides."""

SLACK = 0.3
"""Metres that the base moves from the middle of the grid before the grid follows."""

COARSEST = 0.04
"""Metres of floor below one pixel, beyond which a line of 5 cm is no longer resolved."""

FARTHEST = 2.2
"""Metres from the camera; the floor is not used beyond."""

SILENCE = 2.0
"""Seconds between two pictures after which the grid is cleared: the search was interrupted."""

DARK_LEVEL = 8.0
"""Grey levels added before the logarithm: four times the usual noise of a pixel."""

CONTRAST = 0.35
"""Smallest difference of the logarithms: the floor is 1.4 times as bright as the line."""

SURROUNDINGS = 3.5
"""Width of the top-hat's kernel in widths of the line; wider marks are no lines."""

HUE_TOLERANCE, LEAST_SATURATION, LEAST_VALUE = 28.0, 0.4, 12.0
"""Degrees, share of the brightest channel and grey levels of a pixel of a coloured line."""

BEARINGS = 180
"""Sectors around the camera in which the nearest obstacle hides the floor, 2 degrees each."""

IN_FRONT = 0.06
"""Metres in front of an obstacle's points from which on the floor counts as hidden."""

LEAST_AREA = 0.5
"""Area of the smallest mark that is kept, in squares of the line's width."""


@dataclass(frozen=True)
class _FloorView:
    """View of the floor from above: a rectangle of cells in the base frame.

    Attributes:
        to_image: (3, 3) homography from the centre of a cell (column, row) to a pixel.
        corner: x and y of the first cell's outer corner, base frame, metres.
        valid: (rows, columns) uint8, 255 where the picture resolves the floor.
        camera: x and y of the camera, base frame, metres.
        sectors: (rows, columns) number of the sector of each cell around the camera.
        distances: (rows, columns) metres from the camera.
        maps: columns and rows (rows, columns) of the pixels that show the cells, in place of
            `to_image` where the lens distorts; counted from the centre of the first pixel.
    """

    to_image: FloatArray
    corner: tuple[float, float]
    valid: NDArray[np.uint8]
    camera: FloatArray
    sectors: NDArray[np.int64]
    distances: FloatArray
    maps: tuple[NDArray[np.float32], NDArray[np.float32]] | None = None

    @classmethod
    def of(cls, camera: CameraModel) -> _FloorView | None:
        """Return the view of a camera; None if it sees no floor within reach."""
        count = ceil(FARTHEST / CELL)
        middle = np.round(np.array(camera.position[:2]) / CELL).astype(int)
        first = (middle - count) * CELL
        to_image = _to_image(camera, first)
        columns, rows = np.meshgrid(np.arange(2.0 * count), np.arange(2.0 * count))
        u, v, depth = np.einsum("ij,jrc->irc", to_image, [columns, rows, np.ones_like(rows)])
        u, v = u / depth, v / depth
        if camera.is_distorted:
            cells = np.column_stack([u.ravel(), v.ravel()])
            u, v = (camera.distort_points(cells + 0.5) - 0.5).T.reshape(2, *depth.shape)
        x, y = (CELL * (numbers - count + 0.5) for numbers in (columns, rows))
        distance, height = np.hypot(x, y), camera.position[2]
        coarseness = depth * np.hypot(distance, height) / (min(camera.fx, camera.fy) * height)
        valid = (
            (depth > 0.0) & (u > 0.0) & (v > 0.0) & (distance < FARTHEST)
            & (u < camera.width - 1.0) & (v < camera.height - 1.0) & (coarseness < COARSEST)
        )  # fmt: skip
        if not valid.any():
            return None
        some_rows, some_columns = (np.flatnonzero(valid.any(axis=axis)) for axis in (1, 0))
        top, left = some_rows[0], some_columns[0]
        part = slice(top, some_rows[-1] + 1), slice(left, some_columns[-1] + 1)
        shift = np.array([[1.0, 0.0, left], [0.0, 1.0, top], [0.0, 0.0, 1.0]])
        return cls(
            to_image @ shift,
            (float(first[0] + left * CELL), float(first[1] + top * CELL)),
            255 * valid[part].astype(np.uint8),
            np.array(camera.position[:2]),
            _sectors(x, y)[part],
            distance[part],
            (u[part].astype(np.float32), v[part].astype(np.float32))
            if camera.is_distorted
            else None,
        )

    def open(self, obstacles: FloatArray) -> NDArray[np.uint8]:
        """Return the valid cells in front of all obstacles.

        Args:
            obstacles: (n, 2) base frame, metres.
        """
        if not len(obstacles):
            return self.valid
        x, y = (obstacles - self.camera).T
        nearest = np.full(BEARINGS, np.inf)
        np.minimum.at(nearest, _sectors(x, y), np.hypot(x, y))
        nearest = np.minimum(nearest, np.minimum(np.roll(nearest, 1), np.roll(nearest, -1)))
        hidden = self.distances > nearest[self.sectors] - IN_FRONT
        return np.where(hidden, np.uint8(0), self.valid)

    def of_picture(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return a picture as seen from above: (rows, columns, 3) uint8."""
        rows, columns = self.valid.shape
        smooth = cv2.GaussianBlur(pixels, (3, 3), 0.0)
        if self.maps is not None:
            seen: NDArray[np.uint8] = cv2.remap(  # type: ignore[assignment]
                smooth, *self.maps, cv2.INTER_LINEAR
            )
            return seen
        flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
        view: NDArray[np.uint8] = cv2.warpPerspective(  # type: ignore[assignment]
            smooth, self.to_image, (columns, rows), flags=flags
        )
        return view


def _sectors(x: FloatArray, y: FloatArray) -> NDArray[np.int64]:
    """Return the numbers of the sectors in which points around the camera lie."""
    turns = np.arctan2(y, x) / (2.0 * np.pi) + 0.5
    return np.asarray(np.clip(turns * BEARINGS, 0, BEARINGS - 1), dtype=np.int64)


def _to_image(camera: CameraModel, first: FloatArray) -> FloatArray:
    """Return the homography (3, 3) from cells, the first with a corner at `first`, to pixels."""
    optical_from_base = np.linalg.inv(camera.base_from_optical())
    # OpenCV puts the centre of the first pixel at 0, the camera model at 0.5.
    intrinsics = camera.matrix - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    from_floor = intrinsics @ optical_from_base[:3][:, [0, 1, 3]]
    middle = first + 0.5 * CELL
    from_cells = np.array([[CELL, 0.0, middle[0]], [0.0, CELL, middle[1]], [0.0, 0.0, 1.0]])
    homography: FloatArray = from_floor @ from_cells
    return homography


def line_cells(
    view: NDArray[np.uint8], valid: NDArray[np.uint8], colour: LineColour, width: float
) -> NDArray[np.uint8]:
    """Return the cells of a view from above that belong to lines: uint8, 1 or 0.

    Args:
        view: (rows, columns, 3) uint8 RGB, cells of CELL metres.
        valid: (rows, columns) uint8, 0 where the view shows nothing.
        colour: of the lines.
        width: of the lines, metres.
    """
    if colour in ("dark", "light"):
        found = _contrast(view, valid, width, dark=colour == "dark") > CONTRAST
    else:
        found = has_hue(view, colour, HUE_TOLERANCE, LEAST_SATURATION, LEAST_VALUE)
    cells = (found & (valid > 0)).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(cells, connectivity=8)
    kept = stats[:, cv2.CC_STAT_AREA] * CELL**2 >= LEAST_AREA * width**2
    kept[0] = False
    lines: NDArray[np.uint8] = kept[labels].astype(np.uint8)
    return lines


def _contrast(
    view: NDArray[np.uint8], valid: NDArray[np.uint8], width: float, *, dark: bool
) -> NDArray[np.float32]:
    """Return how much darker or lighter than its surroundings each cell is: a log ratio."""
    grey = cv2.cvtColor(view, cv2.COLOR_RGB2GRAY).astype(np.float32)
    level = np.log(grey + np.float32(DARK_LEVEL))
    if not dark:
        level = -level
    size = round(SURROUNDINGS * width / CELL) | 1
    kernel = cv2.getStructuringElement(cv2.MORPH_RECT, (size, size))
    unseen = valid == 0
    level[unseen] = -100.0
    brightest = cv2.dilate(level, kernel)
    brightest[unseen] = 100.0
    contrast: NDArray[np.float32] = cv2.erode(brightest, kernel) - level
    return contrast


class FloorLineDetector:
    """Detector of lines on the floor, with a memory of the floor around the robot."""

    def __init__(self) -> None:
        self._camera: CameraModel | None = None
        self._view: _FloorView | None = None
        self._wanted: tuple[LineColour, float] | None = None
        self._newest = 0.0
        self._lines: FloorLines | None = None

    def see(
        self, image: Image, base: Pose2D, colour: LineColour, width: float, obstacles: FloatArray
    ) -> FloorLines:
        """Return the lines after a new picture; the same picture again changes nothing.

        Args:
            image: the newest picture.
            base: pose of the base at its stamp, odom frame.
            colour: of the lines.
            width: of the lines, metres.
            obstacles: (n, 2) what hides the floor behind it, odom frame, metres.
        """
        wanted = colour, width
        known = self._lines
        if known is not None and self._wanted == wanted and known.stamp == image.stamp:
            return known
        if image.camera != self._camera:
            self._camera, self._view = image.camera, _FloorView.of(image.camera)
        is_stale = known is None or not 0.0 <= image.stamp - known.stamp <= SILENCE
        if known is None or is_stale or self._wanted != wanted:
            known = _empty(base)
        self._wanted = wanted
        self._lines = self._painted(_following(known, base), image, base, wanted, obstacles)
        return self._lines

    def _painted(
        self, known: FloorLines, image: Image, base: Pose2D, wanted: tuple[LineColour, float],
        obstacles: FloatArray,
    ) -> FloorLines:  # fmt: skip
        """Return the grid with a picture's cells in place of what was there."""
        view = self._view
        if view is None:
            return FloorLines(image.stamp, known.marked, known.seen, known.corner, CELL)
        visible = view.open(base.inverse().transform(obstacles))
        lines = line_cells(view.of_picture(image.pixels), visible, *wanted)
        to_view = _to_view(view.corner, known.corner, base)
        size = known.marked.shape[::-1]
        flags = cv2.INTER_NEAREST | cv2.WARP_INVERSE_MAP
        new = cv2.warpAffine(visible, to_view, size, flags=flags) > 0
        marked = np.where(new, cv2.warpAffine(lines, to_view, size, flags=flags) > 0, known.marked)
        return FloorLines(image.stamp, marked, known.seen | new, known.corner, CELL)


def _empty(base: Pose2D) -> FloorLines:
    count = 2 * round(HALF / CELL)
    corner = tuple(CELL * round((value - HALF) / CELL) for value in (base.x, base.y))
    none = np.zeros((count, count), dtype=np.bool_)
    return FloorLines(0.0, none, none, (corner[0], corner[1]), CELL)


def _following(lines: FloorLines, base: Pose2D) -> FloorLines:
    """Return the grid moved with the base; cells that leave it are forgotten."""
    x, y = lines.corner
    columns, rows = (round(value / CELL) for value in (base.x - HALF - x, base.y - HALF - y))
    if max(abs(columns), abs(rows)) * CELL <= SLACK:
        return lines
    corner = (x + columns * CELL, y + rows * CELL)
    marked, seen = (shifted(cells, rows, columns, False) for cells in (lines.marked, lines.seen))
    return FloorLines(lines.stamp, marked, seen, corner, lines.cell)


def _to_view(view: tuple[float, float], grid: tuple[float, float], base: Pose2D) -> FloatArray:
    """Return the affine map (2, 3) from a grid cell (column, row) to one of the view.

    The corner of the view is in the base frame, that of the grid in the odom frame, metres.
    """
    turn = np.array(
        [[cos(base.heading), sin(base.heading)], [-sin(base.heading), cos(base.heading)]]
    )
    first = turn @ (np.array(grid) + 0.5 * CELL - [base.x, base.y]) - view
    return np.column_stack([turn, first / CELL - 0.5])
