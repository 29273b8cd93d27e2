"""Grids in the map frame: occupancy and cost. Row 0 is at the smallest y."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

FREE_COST, INSCRIBED_COST, LETHAL_COST, UNKNOWN_COST = 0, 253, 254, 255
"""Costmap values as in Nav2: 1..252 inflated, 253 collision of the centre, 254 occupied."""

FREE, OCCUPIED, UNKNOWN = 0, 100, -1
"""Occupancy values as in ROS' OccupancyGrid; those between are percentages."""

FREE_UP_TO, OCCUPIED_FROM = 25, 65
"""Occupancy in percent up to which a cell is free, and from which on it is occupied, as in ROS'
map_server."""


class _Grid(Protocol):
    """Attributes that OccupancyGrid and CostGrid share."""

    @property
    def cells(self) -> NDArray[Any]: ...
    @property
    def resolution(self) -> float: ...
    @property
    def origin(self) -> tuple[float, float]: ...


@dataclass(frozen=True, slots=True)
class OccupancyGrid:
    """A map of free, occupied and unknown cells, in the map frame.

    Cells with a percentage are occupied from `occupied_from` on, free up to FREE_UP_TO, and
    otherwise unknown. Everything that reads a map uses `occupied` and `free`.

    Attributes:
        cells: (rows, columns) int8: FREE 0 to OCCUPIED 100, UNKNOWN -1; row 0 at the smallest y.
        resolution: side of a cell, metres.
        origin: (x, y) of the outer corner of cell (0, 0), metres.
        occupied_from: occupancy in percent from which on a cell is occupied, at least 1.
    """

    cells: NDArray[np.int8]
    resolution: float
    origin: tuple[float, float] = (0.0, 0.0)
    occupied_from: int = OCCUPIED_FROM

    @property
    def occupied(self) -> NDArray[np.bool_]:
        """(rows, columns): cells that are occupied."""
        return self.are_occupied(self.cells)

    @property
    def free(self) -> NDArray[np.bool_]:
        """(rows, columns): cells that are free."""
        return self.are_free(self.cells)

    def are_occupied(self, values: NDArray[Any]) -> NDArray[np.bool_]:
        """Whether cells of these values are occupied, in the shape of the values."""
        occupied: NDArray[np.bool_] = values >= self.occupied_from
        return occupied

    def are_free(self, values: NDArray[Any]) -> NDArray[np.bool_]:
        """Whether cells of these values are free, in the shape of the values."""
        free: NDArray[np.bool_] = (values >= FREE) & (values <= FREE_UP_TO)
        return free & (values < self.occupied_from)

    def cell_at(self: _Grid, x: float, y: float) -> tuple[int, int]:
        """(row, column) of the cell at a point (metres); may be outside the grid."""
        return (
            int((y - self.origin[1]) // self.resolution),
            int((x - self.origin[0]) // self.resolution),
        )

    def centre_of(self: _Grid, row: int, column: int) -> tuple[float, float]:
        """(x, y) of the centre of a cell, metres."""
        return (
            self.origin[0] + (column + 0.5) * self.resolution,
            self.origin[1] + (row + 0.5) * self.resolution,
        )

    def contains(self: _Grid, row: int, column: int) -> bool:
        """Whether the cell is inside the grid."""
        rows, columns = self.cells.shape
        return bool(0 <= row < rows and 0 <= column < columns)


@dataclass(frozen=True, slots=True)
class CostGrid:
    """A costmap: cost of driving through each cell, in the map frame.

    Attributes:
        cells: (rows, columns) uint8, Nav2's values; row 0 at the smallest y.
        resolution: side of a cell, metres.
        origin: (x, y) of the outer corner of cell (0, 0), metres.
    """

    cells: NDArray[np.uint8]
    resolution: float
    origin: tuple[float, float] = (0.0, 0.0)

    cell_at = OccupancyGrid.cell_at
    centre_of = OccupancyGrid.centre_of
    contains = OccupancyGrid.contains
