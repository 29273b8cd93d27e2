"""Static layer: the map."""

from __future__ import annotations

from typing import Any

import numpy as np

from stack.compilation import KernelTypes
from stack.costmap.layer import (
    Box,
    Canvas,
    Costs,
    Frame,
    Layer,
    NoParameters,
    edges,
    part,
    sampled,
    shifted,
)
from stack.types import (
    FREE_COST,
    LETHAL_COST,
    UNKNOWN,
    UNKNOWN_COST,
    Footprint,
    OccupancyGrid,
)


class StaticLayer(Layer):
    """The map: occupied cells are lethal, and sensors do not clear them."""

    @staticmethod
    def kernels() -> KernelTypes:
        from stack.costmap.layers import kernels

        return kernels.MAP

    def __init__(self, parameters: NoParameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        from stack.costmap.layers import kernels

        self._kernels: Any = kernels
        self._cells: Costs = np.empty((0, 0), dtype=np.uint8)
        self._costs: Costs = np.full(256, UNKNOWN_COST, dtype=np.uint8)
        self._is_drawn = False

    def set_map(self, grid: OccupancyGrid | None) -> None:
        super().set_map(grid)
        self._is_drawn = False
        if grid is not None:
            self._costs = _costs_of(grid)

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Sample the map at the cell centres; after a shift only the new cells are sampled."""
        self.frame = frame
        if shift is None or not self._is_drawn or self._cells.shape != frame.shape:
            self._cells, self._is_drawn = self._sampled(frame.everywhere), True
            return
        self._cells = shifted(self._cells, frame.shape, shift, UNKNOWN_COST)
        for strip in edges(frame.shape, shift, lead=0, trail=0):
            part(self._cells, strip)[:] = self._sampled(strip)

    def paint(self, canvas: Canvas) -> None:
        """Paint occupied cells as lethal, and the map's costs where cells are unknown."""
        self._kernels.paint_map(canvas.cells, self._cells, *canvas.box)

    def ground(self, box: Box) -> Costs | None:
        return part(self._cells, box)

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The map where it is occupied, otherwise None."""
        return ("map", None) if self._cells[row, column] == LETHAL_COST else None

    def _sampled(self, box: Box) -> Costs:
        """Costs of the map at the centres of a box's cells; unknown outside the map."""
        if self.map is None:
            return np.full((box[1] - box[0], box[3] - box[2]), UNKNOWN_COST, dtype=np.uint8)
        values = sampled(self.map, self.frame, box, UNKNOWN)
        return self._costs[values.view(np.uint8)]


def _costs_of(grid: OccupancyGrid) -> Costs:
    """Return (256,) costs of a map's values, taken as bytes without a sign."""
    values = np.arange(256, dtype=np.uint8).view(np.int8)
    costs = np.full(256, UNKNOWN_COST, dtype=np.uint8)
    costs[grid.are_free(values)] = FREE_COST
    costs[grid.are_occupied(values)] = LETHAL_COST
    return costs
