"""A ROS map as a world: its occupied cells become boxes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from stack.documents import Finding, Mark
from stack.errors import InputError
from stack.mapping.limits import MAX_SHAPES
from stack.mapping.ros_map import read_ros_map
from stack.sim.worlds.values import EMPTY, TOO_MANY
from stack.sim.worlds.world import Box, World
from stack.types import OccupancyGrid, Pose2D

HEIGHT = 1.0
START_CLEARANCE = 0.5
"""Free distance around the chosen start, metres, if the map has such a place."""


def read_map_world(path: Path) -> World:
    """Read a map.yaml as a world.

    Raises:
        InputError: all findings, each with its position.
    """
    grid = read_ros_map(path)
    rectangles = merged_cells(grid.occupied)
    if not rectangles:
        sentence = "no cell of this map is occupied: a lidar would measure nothing"
        raise InputError([Finding(Mark(str(path)), EMPTY, sentence)])
    if len(rectangles) > MAX_SHAPES:
        sentence = f"its occupied cells need {len(rectangles)} boxes, a world may have {MAX_SHAPES}"
        raise InputError([Finding(Mark(str(path)), TOO_MANY, sentence, "use a coarser map")])
    rows, columns = grid.cells.shape
    x, y = grid.origin
    return World(
        name=path.stem,
        bounds=(x, y, x + columns * grid.resolution, y + rows * grid.resolution),
        boxes=tuple(_box(grid, rectangle) for rectangle in rectangles),
        start=_start(grid),
        source=path,
    )


def merged_cells(occupied: NDArray[np.bool_]) -> list[tuple[int, int, int, int]]:
    """Cover the occupied cells with disjoint rectangles.

    Greedy: a run of cells in a row grows over the next rows as long as they contain the same run.

    Args:
        occupied: (rows, columns).

    Returns:
        First row, last row + 1, first column, last column + 1 of each rectangle.
    """
    found: list[tuple[int, int, int, int]] = []
    growing: dict[tuple[int, int], int] = {}
    for row in range(occupied.shape[0] + 1):
        runs = _runs(occupied[row]) if row < occupied.shape[0] else []
        ended = [run for run in growing if run not in runs]
        found += [(growing.pop(run), row, *run) for run in ended]
        for run in runs:
            growing.setdefault(run, row)
    return found


def _runs(row: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first column and last column + 1 of each run of occupied cells in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(np.int8), [0]])))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]


def _box(grid: OccupancyGrid, rectangle: tuple[int, int, int, int]) -> Box:
    top, bottom, left, right = rectangle
    side = grid.resolution
    middle = Pose2D(
        grid.origin[0] + side * (left + right) / 2, grid.origin[1] + side * (top + bottom) / 2
    )
    return Box(middle, (side * (right - left), side * (bottom - top), HEIGHT), name="the map")


def _start(grid: OccupancyGrid) -> Pose2D:
    """Choose the free place nearest to the origin of the map frame that has enough clearance."""
    import cv2

    free = np.pad(grid.free.astype(np.uint8), 1)
    clearance = cv2.distanceTransform(free, cv2.DIST_L2, 5)[1:-1, 1:-1] * grid.resolution
    rows, columns = np.nonzero(clearance >= min(START_CLEARANCE, float(clearance.max())))
    x = grid.origin[0] + (columns + 0.5) * grid.resolution
    y = grid.origin[1] + (rows + 0.5) * grid.resolution
    nearest = int(np.argmin(np.hypot(x, y)))
    return Pose2D(float(x[nearest]), float(y[nearest]))
