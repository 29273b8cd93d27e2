"""Rasterises a world into the occupancy grid that a perfect survey would give."""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from stack.errors import ParameterError
from stack.mapping.limits import MAX_CELLS
from stack.sim.worlds.outlines import Disc, Outline, Rectangle, outlines
from stack.sim.worlds.world import World
from stack.types import FREE, OCCUPIED, UNKNOWN, FloatArray, OccupancyGrid

RESOLUTION = 0.05
"""Side of a cell of the localiser's map, metres."""
TOUCHING = 1e-6
"""Overlap in metres that counts as none: a wall flush with a cell's edge leaves the cell free."""


def map_shape(world: World, resolution: float = RESOLUTION) -> tuple[int, int]:
    """Return the rows and columns of the map of a world."""
    x_min, y_min, x_max, y_max = world.bounds
    columns = ceil((x_max - x_min) / resolution - TOUCHING)
    return ceil((y_max - y_min) / resolution - TOUCHING), columns


def map_problem(world: World, resolution: float) -> str:
    """Return why no map of a world can be drawn in cells of this size; empty if one can."""
    rows, columns = map_shape(world, resolution)
    if rows * columns <= MAX_CELLS:
        return ""
    x_min, y_min, x_max, y_max = world.bounds
    return (
        f"{world.name} is {x_max - x_min:g} x {y_max - y_min:g} m: its map would have"
        f" {rows * columns} cells of {resolution:g} m, at most {MAX_CELLS} are possible"
    )


def rasterise(world: World, resolution: float = RESOLUTION) -> OccupancyGrid:
    """Return the occupancy grid of a world, over its bounds.

    A cell is OCCUPIED when anything drawn on maps covers any part of it, so the surface that a
    lidar sees lies in an occupied cell and walls are closed however thin. Doors count as open;
    marker boards and people are not drawn. Of the rest, what can be reached from the start
    (stepping over cell edges) is FREE and everything else UNKNOWN.

    Args:
        world: world to draw.
        resolution: side of a cell, metres.

    Raises:
        ParameterError: the grid would have more than 8192 x 8192 cells.
    """
    problem = map_problem(world, resolution)
    if problem:
        raise ParameterError("resolution", problem, "use larger cells or closer bounds")
    covered = covered_cells(world, resolution, mapped_only=True)
    grid = OccupancyGrid(np.full(covered.shape, UNKNOWN, np.int8), resolution, world.bounds[:2])
    grid.cells[_reached(~covered, grid.cell_at(world.start.x, world.start.y))] = FREE
    grid.cells[covered] = OCCUPIED
    return grid


def covered_cells(
    world: World, resolution: float, *, mapped_only: bool = False
) -> NDArray[np.bool_]:
    """Return which cells walls, boxes and cylinders overlap: (rows, columns) over the bounds.

    Args:
        world: world to draw; its doors are open.
        resolution: side of a cell, metres.
        mapped_only: only what is on the map.
    """
    covered = np.zeros(map_shape(world, resolution), dtype=np.bool_)
    cells = np.zeros(covered.shape, np.int8)
    grid = OccupancyGrid(cells, resolution, world.bounds[:2])
    for outline in outlines(world, mapped_only=mapped_only):
        _cover(covered, outline, grid)
    return covered


def cells_near(world: World, resolution: float, distance: float) -> NDArray[np.bool_]:
    """Return the cells whose middles are nearer to an obstacle than a distance.

    The distances are exact, so that two cells of a way on which a disc of this radius fits are
    never separated by the grid.

    Args:
        world: world with walls, boxes and cylinders; its doors are open.
        resolution: side of a cell, metres.
        distance: metres, > 0.

    Returns:
        (rows, columns) over the bounds.
    """
    found = np.zeros(map_shape(world, resolution), dtype=np.bool_)
    grid = OccupancyGrid(np.zeros(found.shape, np.int8), resolution, world.bounds[:2])
    for outline in outlines(world):
        near, xs, ys = _window(found, outline, grid, distance)
        if near.size:
            apart = outline.distance_to(np.column_stack([xs.ravel(), ys.ravel()]))
            near |= apart.reshape(near.shape) < distance - TOUCHING
    return found


def _window(
    cells: NDArray[np.bool_], outline: Outline, grid: OccupancyGrid, margin: float
) -> tuple[NDArray[np.bool_], FloatArray, FloatArray]:
    """Return the cells within a margin of an outline's extent, with x and y of their middles."""
    x_min, y_min, x_max, y_max = outline.extent
    first_row, first_column = grid.cell_at(x_min - margin, y_min - margin)
    last_row, last_column = grid.cell_at(x_max + margin, y_max + margin)
    rows = slice(max(first_row, 0), max(last_row + 1, 0))
    columns = slice(max(first_column, 0), max(last_column + 1, 0))
    near = cells[rows, columns]
    middles_x = grid.origin[0] + (columns.start + 0.5 + np.arange(near.shape[1])) * grid.resolution
    middles_y = grid.origin[1] + (rows.start + 0.5 + np.arange(near.shape[0])) * grid.resolution
    xs, ys = np.meshgrid(middles_x, middles_y)
    return near, xs, ys


def _cover(covered: NDArray[np.bool_], outline: Outline, grid: OccupancyGrid) -> None:
    """Mark the cells that an outline overlaps; only cells near it are tested."""
    near, xs, ys = _window(covered, outline, grid, TOUCHING)
    if near.size == 0:
        return
    if isinstance(outline, Disc):
        near |= _disc_overlap(outline, xs, ys, grid.resolution / 2)
    else:
        near |= _rectangle_overlap(outline, xs, ys, grid.resolution / 2)


def _disc_overlap(disc: Disc, xs: FloatArray, ys: FloatArray, half: float) -> NDArray[np.bool_]:
    """Tell whether square cells with centres (xs, ys) and side 2 half overlap a disc."""
    beside_x = np.maximum(np.abs(xs - disc.x) - half, 0.0)
    beside_y = np.maximum(np.abs(ys - disc.y) - half, 0.0)
    overlapping: NDArray[np.bool_] = np.hypot(beside_x, beside_y) < disc.radius - TOUCHING
    return overlapping


def _rectangle_overlap(
    rectangle: Rectangle, xs: FloatArray, ys: FloatArray, half: float
) -> NDArray[np.bool_]:
    """Tell whether square cells overlap a rectangle, by the separating axes of both."""
    pose = rectangle.pose
    c, s = np.cos(pose.heading), np.sin(pose.heading)
    dx, dy = xs - pose.x, ys - pose.y
    cell_reach = half * (abs(c) + abs(s))
    reach_x = abs(c) * rectangle.half_length + abs(s) * rectangle.half_width
    reach_y = abs(s) * rectangle.half_length + abs(c) * rectangle.half_width
    overlapping: NDArray[np.bool_] = (
        (np.abs(dx) < reach_x + half - TOUCHING)
        & (np.abs(dy) < reach_y + half - TOUCHING)
        & (np.abs(c * dx + s * dy) < rectangle.half_length + cell_reach - TOUCHING)
        & (np.abs(c * dy - s * dx) < rectangle.half_width + cell_reach - TOUCHING)
    )
    return overlapping


def _reached(passable: NDArray[np.bool_], start: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the cells 4-connected to the start; none when it is occupied or off the grid."""
    import cv2

    _, labels = cv2.connectedComponents(passable.astype(np.uint8), connectivity=4)
    rows, columns = passable.shape
    inside = 0 <= start[0] < rows and 0 <= start[1] < columns
    reached: NDArray[np.bool_] = passable & (labels == labels[start] if inside else False)
    return reached
