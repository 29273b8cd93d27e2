"""Depth layer: obstacles and missing floor that depth cameras have seen."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import (
    NO_BOX,
    Box,
    Canvas,
    Frame,
    Layer,
    LayerUpdate,
    NoParameters,
    Region,
    is_some,
    part,
)
from stack.types import LETHAL_COST, FloatArray, Footprint


class DepthLayer(Layer):
    """Obstacles from depth cameras: table tops, kerbs, edges of stairs.

    The points and their memory are those of `depth` (stack/perception/depth/obstacles.py), which
    also serve safety and controllers; the layer only draws them. It never frees a cell.
    """

    needs = ("depth_camera",)

    def __init__(self, parameters: NoParameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._points: FloatArray = np.empty((0, 2))
        self._marked: NDArray[np.bool_] = np.zeros((0, 0), dtype=bool)
        self._drawn: NDArray[np.int64] = np.empty(0, dtype=np.int64)  # rising indices of cells
        self._seen_at = 0.0

    @property
    def marked(self) -> NDArray[np.bool_]:
        """(rows, columns): cells with an obstacle."""
        return self._marked

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        self.frame = frame
        self._marked = np.zeros(frame.shape, dtype=bool)
        self._draw(self._cells())

    def update(self, update: LayerUpdate) -> Box:
        if update.depth is None:
            return NO_BOX
        self._points, self._seen_at = update.depth, update.time
        before, cells = self._drawn, self._cells()
        changed = np.setxor1d(before, cells, assume_unique=True)
        if not len(changed):
            return NO_BOX
        self._marked.flat[before] = False
        self._draw(cells)
        rows, columns = np.divmod(changed, self._marked.shape[1])
        return int(rows[0]), int(rows[-1]) + 1, int(columns.min()), int(columns.max()) + 1

    def paint(self, canvas: Canvas) -> None:
        if not len(self._drawn):
            return
        canvas.cells[part(self._marked, canvas.box)] = LETHAL_COST

    def clear(self, region: Region | None) -> Box:
        """Clear the drawn obstacles; those that are still kept are drawn with the next picture."""
        if region is None:
            self._marked[:] = False
            self._drawn = np.empty(0, dtype=np.int64)
            return self.frame.everywhere
        if not is_some(region.box):
            return NO_BOX
        part(self._marked, region.box)[region.inside] = False
        self._drawn = self._drawn[self._marked.flat[self._drawn]]
        return region.box

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The depth cameras, and the time of the newest picture."""
        return ("depth", self._seen_at) if self._marked[row, column] else None

    def _draw(self, cells: NDArray[np.int64]) -> None:
        self._marked.flat[cells] = True
        self._drawn = cells

    def _cells(self) -> NDArray[np.int64]:
        """Return the cells of the points inside the costmap: rising, each once."""
        rows, columns = self.frame.shape
        x, y = self.frame.origin
        row = np.floor((self._points[:, 1] - y) / self.frame.resolution).astype(np.int64)
        column = np.floor((self._points[:, 0] - x) / self.frame.resolution).astype(np.int64)
        inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        found: NDArray[np.int64] = np.unique(row[inside] * columns + column[inside])
        return found
