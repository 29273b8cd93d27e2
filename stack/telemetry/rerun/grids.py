"""Grids in a rerun recording: large ones as tiles that are logged when they change."""

from __future__ import annotations

from typing import Any

import numpy as np
import pyarrow as pa
import rerun as rr
from numpy.typing import NDArray

from stack.telemetry.grid_colours import (
    OUTSIDE_COSTS,
    OUTSIDE_MAP,
    Picture,
    coloured,
    cost_table,
    map_table,
)
from stack.telemetry.records import Layer
from stack.telemetry.rerun.recording import Recording
from stack.types import CostGrid, OccupancyGrid

Grid = OccupancyGrid | CostGrid
Box = tuple[int, int, int, int]
"""First row, row after the last, first column, column after the last."""

HEIGHTS = {"map": 0.0, "global_costmap": 0.006, "local_costmap": 0.012}
"""Drawing height of each grid, metres, so that they overlap in this order."""

DEFAULT_HEIGHT = 0.009

MAP_OPACITY, COST_OPACITY = 0.99, 0.8
"""At an opacity of 1 the viewer shows transparent cells in black."""

COST_TILE, MAP_TILE = 128, 512
"""Cells on the side of a tile. Costs change in small parts, the map as a whole."""

_BYTES = rr.components.ImageBufferBatch._ARROW_DATATYPE


class GridDrawing:
    """A map or costmap that does not move, drawn as square tiles.

    Only tiles with a visible cell are drawn, and again only when a cell changed.

    Args:
        recording: to draw into.
        name: of the layer; tiles are entities below it.
        grid: its first version. Tiles keep their places when the grid grows.
    """

    def __init__(self, recording: Recording, name: str, grid: Grid) -> None:
        self._recording, self._name = recording, name
        self._anchor, self._resolution = grid.origin, grid.resolution
        is_map = isinstance(grid, OccupancyGrid)
        self._side = MAP_TILE if is_map else COST_TILE
        self._table = map_table() if is_map else cost_table(name)
        self._outside = OUTSIDE_MAP if is_map else OUTSIDE_COSTS
        self._opaque = self._table[:, 3] > 0
        self._drawn: dict[tuple[int, int], NDArray[np.uint8]] = {}
        self._version, self._shape, self._origin = -1, grid.cells.shape, grid.origin

    def fits(self, grid: Grid) -> bool:
        """Whether the grid has the resolution of the first one."""
        return grid.resolution == self._resolution

    def draw(self, layer: Layer) -> None:
        """Draw the tiles that changed since the last call."""
        grid = layer.content
        assert isinstance(grid, OccupancyGrid | CostGrid)
        cells = grid.cells.view(np.uint8)
        moved = cells.shape != self._shape or grid.origin != self._origin
        self._shape, self._origin = cells.shape, grid.origin
        column, row = (
            round((here - there) / self._resolution)
            for here, there in zip(grid.origin, self._anchor, strict=True)
        )
        boxes = None if moved else _changes_since(layer, self._version)
        self._version = layer.version
        whole = (0, cells.shape[0], 0, cells.shape[1])
        wanted = sorted(self._tiles(boxes if boxes is not None else [whole], row, column))
        for tile in wanted:
            self._draw_tile(tile, self._cells_of(tile, cells, row, column))

    def hide(self) -> None:
        """Remove all tiles from the view."""
        for tile in self._drawn:
            self._recording.hide(self._path(tile))
        self._drawn.clear()
        self._version = -1

    def _tiles(self, boxes: list[Box], row: int, column: int) -> set[tuple[int, int]]:
        """The tiles that the boxes touch, for a grid whose cell (0, 0) is at row and column."""
        side = self._side
        return {
            (down, right)
            for top, bottom, left, right_end in boxes
            for down in range((row + top) // side, -(-(row + bottom) // side))
            for right in range((column + left) // side, -(-(column + right_end) // side))
        }

    def _cells_of(
        self, tile: tuple[int, int], cells: NDArray[np.uint8], row: int, column: int
    ) -> NDArray[np.uint8]:
        """The cells (side, side) of a tile; outside the grid they are transparent."""
        side = self._side
        top, left = tile[0] * side - row, tile[1] * side - column
        inside = cells[max(top, 0) : max(top + side, 0), max(left, 0) : max(left + side, 0)]
        if inside.shape == (side, side):
            return inside
        padded = np.full((side, side), self._outside, np.uint8)
        down, right = max(-top, 0), max(-left, 0)
        padded[down : down + inside.shape[0], right : right + inside.shape[1]] = inside
        return padded

    def _draw_tile(self, tile: tuple[int, int], cells: NDArray[np.uint8]) -> None:
        before = self._drawn.get(tile)
        if before is None:
            if not self._opaque[cells].any():
                return
            self._recording.fix(self._path(tile), self._tile_constants(tile))
        elif np.array_equal(before, cells):
            return
        self._drawn[tile] = cells.copy()
        pixels = _pixels(coloured(cells, self._table))
        self._recording.show(self._path(tile), rr.GridMap.from_fields(data=pixels))

    def _tile_constants(self, tile: tuple[int, int]) -> Any:
        """What does not change of a tile: size, position and order."""
        side = self._side * self._resolution
        x, y = self._anchor[0] + tile[1] * side, self._anchor[1] + tile[0] * side
        place = (x, y, HEIGHTS.get(self._name, DEFAULT_HEIGHT))
        return _constants(self._name, (self._side, self._side), self._resolution, place)

    def _path(self, tile: tuple[int, int]) -> str:
        return f"world/{self._name}/{tile[0]}_{tile[1]}"


class WindowDrawing:
    """A small grid that moves, drawn whole.

    Args:
        recording: to draw into.
        name: of the layer.
        grid: its first version, which has its constant shape and resolution.
    """

    def __init__(self, recording: Recording, name: str, grid: Grid) -> None:
        self._shape, self._resolution = grid.cells.shape, grid.resolution
        rows, columns = self._shape
        self._recording, self._path = recording, f"world/{name}/{rows}x{columns}"
        self._height = HEIGHTS.get(name, DEFAULT_HEIGHT)
        self._table = cost_table(name)
        recording.fix(self._path, _constants(name, self._shape, self._resolution))

    def fits(self, grid: Grid) -> bool:
        """Whether the grid has the shape and resolution of the first one."""
        return grid.cells.shape == self._shape and grid.resolution == self._resolution

    def draw(self, layer: Layer) -> None:
        """Draw all cells at their current place."""
        grid = layer.content
        assert isinstance(grid, CostGrid)
        drawn = rr.GridMap.from_fields(
            data=_pixels(coloured(grid.cells, self._table)),
            translation=(*grid.origin, self._height),
        )
        self._recording.show(self._path, drawn)

    def hide(self) -> None:
        """Remove the grid from the view."""
        self._recording.hide(self._path)


def _changes_since(layer: Layer, version: int) -> list[Box] | None:
    """The boxes that changed since a version; None if the layer does not know them all."""
    found = [(number, box) for number, box in layer.changes if number > version]
    if found and found[0][0] == version + 1:
        return [box for _, box in found]
    return [] if layer.version == version else None


def _constants(
    name: str, shape: tuple[int, ...], resolution: float,
    translation: tuple[float, float, float] | None = None,
) -> Any:  # fmt: skip
    """What does not change of a grid or tile: size, resolution and order, and perhaps place."""
    return rr.GridMap.from_fields(
        format=rr.components.ImageFormat(
            shape[1], shape[0], color_model="RGBA", channel_datatype="U8"
        ),
        cell_size=resolution,
        translation=translation,
        opacity=MAP_OPACITY if name == "map" else COST_OPACITY,
        draw_order=HEIGHTS.get(name, DEFAULT_HEIGHT),
    )


def _pixels(picture: Picture) -> Any:
    """The bytes of a picture as rerun's batch, without rerun's conversions: half the time."""
    pixels = pa.array(picture.reshape(-1))
    ends = pa.py_buffer(np.array([0, len(pixels)], np.int32))
    rows = pa.ListArray.from_buffers(_BYTES, 1, [None, ends], children=[pixels])
    return rr.components.ImageBufferBatch(rows)
