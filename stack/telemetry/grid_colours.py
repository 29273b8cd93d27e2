"""Maps and costmaps as RGBA pictures for a dark background."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from stack.types import FREE_COST, INSCRIBED_COST, LETHAL_COST

Picture = NDArray[np.uint8]

_FLOOR = (33, 42, 58, 255)
_WALL = (112, 128, 156, 255)
_UNKNOWN = (15, 20, 29, 255)

_RAMPS = {
    "global_costmap": ((92, 84, 190, 10), (140, 86, 200, 95)),
    "local_costmap": ((214, 140, 40, 14), (232, 84, 74, 120)),
}
_LETHAL_ALPHA = 130

OUTSIDE_MAP, OUTSIDE_COSTS = 254, 255
"""Transparent cells: not an occupancy, and the cost of unknown cells."""


def map_table() -> Picture:
    """(256, 4) RGBA of each occupancy, as unsigned byte."""
    table = np.empty((256, 4), np.uint8)
    table[:] = _UNKNOWN
    shades = np.linspace(_FLOOR, _WALL, 101)
    table[:101] = shades.round().astype(np.uint8)
    table[OUTSIDE_MAP, 3] = 0
    return table


@lru_cache(maxsize=8)
def cost_table(layer: str) -> Picture:
    """(256, 4) RGBA of each cost in a costmap; free and unknown are transparent."""
    low, high = _RAMPS.get(layer, _RAMPS["global_costmap"])
    table = np.zeros((256, 4), np.uint8)
    table[FREE_COST + 1 : INSCRIBED_COST] = (
        np.linspace(low, high, INSCRIBED_COST - FREE_COST - 1).round().astype(np.uint8)
    )
    table[INSCRIBED_COST : LETHAL_COST + 1] = (*high[:3], _LETHAL_ALPHA)
    return table


def coloured(cells: NDArray[np.uint8], table: Picture) -> Picture:
    """(rows, columns, 4) RGBA: the colour (256, 4) of each cell, the grid's last row first.

    A pixel is taken as one 32-bit word: 12 times as fast as four bytes.
    """
    pixels = np.take(table.view(np.uint32)[:, 0], cells[::-1])
    return pixels.view(np.uint8).reshape(*cells.shape, 4)
