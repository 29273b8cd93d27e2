"""Combines the layers of a costmap into its cells, one box at a time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.costmap.inflation import Inflation
from stack.costmap.layer import (
    NO_BOX,
    Box,
    Canvas,
    Costs,
    Frame,
    Layer,
    edges,
    is_some,
    joined,
    part,
    shifted,
)
from stack.types import UNKNOWN_COST

BAND_CELLS = 1 << 20
"""Cells that are painted at once, so that the work arrays stay small."""


class LayerCompositor:
    """Three grids: cells marked by layers, the inflated costs, and the costs with additions.

    Attributes:
        marking: layers whose marks are inflated, in order.
        cells: (rows, columns) uint8, the costs.
    """

    def __init__(
        self, marking: Sequence[Layer], inflation: Inflation, adding: Sequence[Layer]
    ) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self.marking, self._inflation, self._adding = marking, inflation, adding
        self._frame = Frame((0, 0), 1.0, (0.0, 0.0))
        self._shift = (0, 0)
        self._base = self._inflated = self.cells = np.empty((0, 0), dtype=np.uint8)

    def mark_with(self, marking: Sequence[Layer]) -> None:
        """Use other marking layers; call `repaint_all` afterwards."""
        self.marking = marking

    @property
    def marks(self) -> NDArray[np.uint8]:
        """(rows, columns) cells as the marking layers have painted them, not inflated."""
        return self._base

    def lay_out(self, frame: Frame) -> None:
        """Allocate the grids; call `repaint_all` afterwards."""
        self._frame, self._shift = frame, (0, 0)
        self._inflation.set_resolution(frame.resolution)
        self._set_grids([np.empty(frame.shape, dtype=np.uint8) for _ in range(3)])

    def move(self, frame: Frame, shift: tuple[int, int]) -> None:
        """Shift the grids and keep the cells that stay inside; call `repaint` afterwards.

        Args:
            frame: the new frame, of the same shape.
            shift: (rows, columns) by which it moved.
        """
        self._frame, self._shift = frame, shift
        grids = (self._base, self._inflated, self.cells)
        self._set_grids([shifted(grid, frame.shape, shift, UNKNOWN_COST) for grid in grids])

    def repaint_all(self) -> None:
        """Repaint all cells."""
        self._shift = (0, 0)
        for band in _bands(self._frame.everywhere):
            self._compose(band)
        self._finish([self._frame.everywhere])

    def repaint(self, marked: Box, added: Box) -> Box:
        """Repaint changed cells; return the box of the costs that may have changed.

        Args:
            marked: box to repaint for the marking layers.
            added: box to repaint for the layers that add costs.
        """
        shape, far = self._frame.shape, sum(layer.reach for layer in self.marking)
        reach = self._inflation.reach
        moved, self._shift = self._shift, (0, 0)
        paint = [*edges(shape, moved, lead=far, trail=far), self._grown(marked, far)]
        changed = [self._compose(band) for box in paint for band in _bands(box)]
        spread = edges(shape, moved, lead=reach, trail=reach)
        spread += [self._grown(box, reach) for box in changed]
        if added != NO_BOX or any(map(is_some, spread)):
            self._finish([box for box in spread if is_some(box)], added)
        return self._frame.everywhere if moved != (0, 0) else joined([*spread, added])

    def _set_grids(self, grids: list[Costs]) -> None:
        self._base, self._inflated, self.cells = grids
        if not self._adding:
            self.cells = self._inflated

    def _compose(self, box: Box) -> Box:
        """Paint a box with the marking layers; return the box of the cells that changed."""
        if not is_some(box):
            return NO_BOX
        far = sum(layer.reach for layer in self.marking)
        around = self._frame.grown(box, far)
        cells = np.full((around[1] - around[0], around[3] - around[2]), UNKNOWN_COST, np.uint8)
        canvas = Canvas(cells, self.ground(around), around)
        for layer in self.marking:
            layer.paint(canvas)
        changed: Box = self._kernels.write_changed(self._base, cells, around[0], around[2], *box)
        return changed

    def _finish(self, spread: list[Box], added: Box = NO_BOX) -> None:
        """Inflate some boxes, and add costs to them and to `added`."""
        if sum(map(_area, spread)) >= _area(self._frame.everywhere):
            spread = [self._frame.everywhere]
        bands = [band for box in spread for band in _bands(box)]
        for band in bands:
            self._inflation.spread(self._inflated, self._base, band)
        if not self._adding:
            return
        for box in (*bands, *_bands(added)):
            cells = part(self.cells, box)
            cells[:] = part(self._inflated, box)
            canvas = Canvas(cells, self.ground(box), box)
            for layer in self._adding:
                layer.paint(canvas)

    def ground(self, box: Box) -> Costs:
        """Return the costs of the map alone in a box; unknown without a map."""
        for layer in self.marking:
            costs = layer.ground(box)
            if costs is not None:
                return costs
        return np.full((box[1] - box[0], box[3] - box[2]), UNKNOWN_COST, np.uint8)

    def _grown(self, box: Box, by: int) -> Box:
        return self._frame.grown(box, by) if is_some(box) else NO_BOX


def _bands(box: Box) -> list[Box]:
    """Cut a large box into bands of rows."""
    top, bottom, left, right = box
    step = max(1, BAND_CELLS // max(right - left, 1))
    return [(row, min(row + step, bottom), left, right) for row in range(top, bottom, step)]


def _area(box: Box) -> int:
    return (box[1] - box[0]) * (box[3] - box[2])
