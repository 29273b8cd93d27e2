"""Static layer: the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from stack.costmap.layer import (
    NO_BOX,
    Box,
    Canvas,
    Costs,
    Frame,
    Region,
    SensorUpdate,
    edges,
    part,
    shifted,
)
from stack.costmap.sampling import sampled
from stack.types import (
    FREE_COST,
    LETHAL_COST,
    OCCUPIED,
    UNKNOWN,
    UNKNOWN_COST,
    Footprint,
    OccupancyGrid,
)


class StaticLayer:
    """The map: occupied cells are lethal, and sensors do not clear them."""

    @dataclass(frozen=True)
    class Parameters:
        """No parameters."""

    needs_tracks: ClassVar[bool] = False
    reach = 0

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        self._map: OccupancyGrid | None = None
        self._frame = Frame((0, 0), 1.0, (0.0, 0.0))
        self.cells: Costs = np.empty((0, 0), dtype=np.uint8)

    def configure(self, parameters: Parameters) -> None:
        """Do nothing: there are no parameters."""

    def take(self, grid: OccupancyGrid | None) -> None:
        """Use another map, from the next `lay_out` on."""
        self._map = grid

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Sample the map at the cell centres; after a shift only the new cells are sampled."""
        same = shift is not None and self.cells.shape == frame.shape
        self._frame = frame
        if not same or shift is None:
            self.cells = self._sampled(frame.everywhere)
            return
        self.cells = shifted(self.cells, frame.shape, shift, UNKNOWN_COST)
        for strip in edges(frame.shape, shift, lead=0, trail=0):
            part(self.cells, strip)[:] = self._sampled(strip)

    def update(self, senses: SensorUpdate) -> Box:
        """Change nothing: sensors do not change the map."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Paint occupied cells as lethal, and the map's costs where cells are unknown."""
        ours = part(self.cells, canvas.box)
        write = (canvas.cells == UNKNOWN_COST) | (ours == LETHAL_COST)
        np.copyto(canvas.cells, ours, where=write)

    def clear(self, region: Region | None) -> Box:
        """Change nothing: the map stays."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The map where it is occupied, otherwise None."""
        return ("map", None) if self.cells[row, column] == LETHAL_COST else None

    def _sampled(self, box: Box) -> Costs:
        """Costs of the map at the centres of a box's cells; unknown outside the map."""
        if self._map is None:
            return np.full((box[1] - box[0], box[3] - box[2]), UNKNOWN_COST, dtype=np.uint8)
        values = sampled(self._map, self._frame, box, UNKNOWN)
        costs = np.full(values.shape, FREE_COST, dtype=np.uint8)
        costs[values == OCCUPIED] = LETHAL_COST
        costs[values == UNKNOWN] = UNKNOWN_COST
        return costs
