"""A ROS map as a world: its occupied cells become boxes."""

from __future__ import annotations

from pathlib import Path

from stack.documents import Finding, Findings, Mark
from stack.errors import InputError
from stack.mapping.limits import MAX_SHAPES
from stack.mapping.ros_map import read_ros_map
from stack.sim.worlds.free_place import free_place
from stack.sim.worlds.rectangles import merged_cells
from stack.sim.worlds.values import EMPTY, TOO_MANY
from stack.sim.worlds.world import Box, World
from stack.types import OccupancyGrid, Pose2D

HEIGHT = 1.0


def read_map_world(path: Path) -> World:
    """Read a map.yaml, or its image, as a world.

    Raises:
        InputError: all findings, each with its position.
    """
    findings = Findings()
    grid = read_ros_map(path, findings)
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
        start=free_place(grid),
        source=path,
        warnings=tuple(findings.items),
    )


def _box(grid: OccupancyGrid, rectangle: tuple[int, int, int, int]) -> Box:
    top, bottom, left, right = rectangle
    side = grid.resolution
    middle = Pose2D(
        grid.origin[0] + side * (left + right) / 2, grid.origin[1] + side * (top + bottom) / 2
    )
    return Box(middle, (side * (right - left), side * (bottom - top), HEIGHT), name="the map")
