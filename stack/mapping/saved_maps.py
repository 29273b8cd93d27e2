"""The folder of a saved map: map.yaml and map.pgm, and the pose graph if there is one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stack.mapping.ros_map import map_files
from stack.types import OccupancyGrid

MAP_YAML, MAP_IMAGE = "map.yaml", "map.pgm"
"""Names of the map's files in the folder of a saved map."""

MARGIN = 1.0
"""Metres around the obstacles of a saved map."""


def folder_contents(grid: OccupancyGrid, further: Mapping[str, bytes]) -> dict[str, bytes]:
    """Return the contents of the files of a map's folder, by name.

    Args:
        grid: the map; it is cropped.
        further: files of the estimator, e.g. of the pose graph.
    """
    return {**map_files(cropped(grid, MARGIN), MAP_YAML, MAP_IMAGE), **further}


def cropped(grid: OccupancyGrid, margin: float) -> OccupancyGrid:
    """Return the part of a map with its occupied cells and `margin` metres around them.

    Free cells farther away are seen through gaps. A map without occupied cells is returned whole.
    """
    cells = np.argwhere(grid.occupied)
    if not cells.size:
        return grid
    more = round(margin / grid.resolution)
    low = np.maximum(cells.min(axis=0) - more, 0)
    high = np.minimum(cells.max(axis=0) + more + 1, grid.cells.shape)
    x, y = grid.origin
    origin = (x + float(low[1]) * grid.resolution, y + float(low[0]) * grid.resolution)
    part = np.ascontiguousarray(grid.cells[low[0] : high[0], low[1] : high[1]])
    return OccupancyGrid(part, grid.resolution, origin, grid.occupied_from)
