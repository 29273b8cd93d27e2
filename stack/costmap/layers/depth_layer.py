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

    The points and their memory are those of `depth` (stack/perception/depth_obstacles.py), which
    also serve safety and controllers; the layer only draws them. It never frees a cell.
    """

    def __init__(self, parameters: NoParameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._points: FloatArray = np.empty((0, 2))
        self._marked: NDArray[np.bool_] = np.zeros((0, 0), dtype=bool)
        self._seen_at = 0.0

    @property
    def marked(self) -> NDArray[np.bool_]:
        """(rows, columns): cells with an obstacle."""
        return self._marked

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Draw the points at the new position."""
        self.frame = frame
        self._marked = self._drawn()

    def update(self, update: LayerUpdate) -> Box:
        """Draw new points; return the box of the cells that changed."""
        if update.depth is None:
            return NO_BOX
        self._points, self._seen_at = update.depth, update.time
        before, self._marked = self._marked, self._drawn()
        changed = before != self._marked
        rows, columns = np.flatnonzero(changed.any(axis=1)), np.flatnonzero(changed.any(axis=0))
        if not len(rows):
            return NO_BOX
        return int(rows[0]), int(rows[-1]) + 1, int(columns[0]), int(columns[-1]) + 1

    def paint(self, canvas: Canvas) -> None:
        """Paint the cells with an obstacle as lethal."""
        if not len(self._points):
            return
        canvas.cells[part(self._marked, canvas.box)] = LETHAL_COST

    def clear(self, region: Region | None) -> Box:
        """Clear the drawn obstacles; those that are still kept are drawn with the next picture."""
        if region is None:
            self._marked = np.zeros(self.frame.shape, dtype=bool)
            return self.frame.everywhere
        if not is_some(region.box):
            return NO_BOX
        part(self._marked, region.box)[region.inside] = False
        return region.box

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The depth cameras, and the time of the newest picture."""
        return ("depth", self._seen_at) if self._marked[row, column] else None

    def _drawn(self) -> NDArray[np.bool_]:
        marked = np.zeros(self.frame.shape, dtype=bool)
        cells = np.floor((self._points - self.frame.origin) / self.frame.resolution).astype(int)
        rows, columns = cells[:, 1], cells[:, 0]
        inside = (rows >= 0) & (rows < marked.shape[0])
        inside &= (columns >= 0) & (columns < marked.shape[1])
        marked[rows[inside], columns[inside]] = True
        return marked
