"""Room for things and robots in a world: what faults may move where."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from stack.geometry.connected import connected_to
from stack.sim.worlds.outlines import outline_of, outlines
from stack.sim.worlds.rasterise import covered_cells
from stack.sim.worlds.world import Box, World
from stack.types import FloatArray, OccupancyGrid, Pose2D

if TYPE_CHECKING:
    from stack.sim.simulated_robot import SimulatedRobot
    from stack.sim.simulation import Simulation

RESOLUTION = 0.1
"""Side of the cells in which room is measured, metres."""

KEPT_FROM_MOVERS = 0.5
"""Metres between a robot that is put down and people and other robots."""

SPACING = 0.05
"""Metres between the points of a box that are compared with other things."""


def reachable(world: World, radius: float, start: Pose2D) -> OccupancyGrid:
    """Return where a disc can go from the start through open doors: cells are 1, others 0.

    Args:
        world: with its boxes where they stand.
        radius: of the disc, metres.
        start: its middle.
    """
    import cv2

    covered = covered_cells(world, RESOLUTION)
    free = np.pad((~covered).astype(np.uint8), 1)
    clearance = cv2.distanceTransform(free, cv2.DIST_L2, 5)[1:-1, 1:-1] * RESOLUTION
    grid = OccupancyGrid(np.zeros(covered.shape, np.int8), RESOLUTION, world.bounds[:2])
    fits: NDArray[np.bool_] = clearance >= radius
    cell = grid.cell_at(start.x, start.y)
    fits[cell] = True
    return replace(grid, cells=connected_to(fits, [cell]).astype(np.int8))


def free_places(simulation: Simulation, robot: SimulatedRobot, distance: float) -> FloatArray:
    """Return points (n, 2) at a distance from a robot that it can reach, metres.

    They are off people and other robots.
    """
    radius, start = robot.radius, robot.truth.pose
    world = simulation.world
    dropped = tuple(
        Box(box.pose, (side, side, box.height))
        for box in simulation.boxes
        for side in [2.0 * box.footprint.circumscribed_radius]
    )
    grid = reachable(replace(world, boxes=(*world.boxes, *dropped)), radius, start)
    rows, columns = np.nonzero(grid.cells)
    points = np.column_stack([columns + 0.5, rows + 0.5]) * grid.resolution + grid.origin
    away = np.hypot(points[:, 0] - start.x, points[:, 1] - start.y)
    points = points[np.abs(away - distance) < RESOLUTION]
    x, y, radii = simulation.movers(but=robot).T
    gaps = np.hypot(points[:, :1] - x, points[:, 1:] - y) - radii - radius
    chosen: FloatArray = points[np.all(gaps >= KEPT_FROM_MOVERS, axis=1)]
    return chosen


def keeps_clear(box: Box, world: World, radius: float, start: Pose2D) -> bool:
    """Return whether a box stands in no other thing, and off the start, places and docks.

    Args:
        box: where it would stand.
        world: without it.
        radius: that stays clear, of the robot, metres.
        start: of the robot.
    """
    own = outline_of(box)
    kept = [start, *world.places.values(), *(Pose2D(dock.x, dock.y) for dock in world.docks)]
    if own.distance_to(np.array([(pose.x, pose.y) for pose in kept])).min() < radius:
        return False
    x_min, y_min, x_max, y_max = own.extent
    if not (x_min > world.bounds[0] and y_min > world.bounds[1]
            and x_max < world.bounds[2] and y_max < world.bounds[3]):  # fmt: skip
        return False
    points = _points(box)
    return all(outline.distance_to(points).min() > 0.0 for outline in outlines(world))


def leaves_ways(before: OccupancyGrid, world: World, radius: float, start: Pose2D) -> bool:
    """Return whether all places that could be reached before still can be."""
    after = reachable(world, radius, start)
    cells = [before.cell_at(pose.x, pose.y) for pose in world.places.values()]
    rows, columns = before.cells.shape
    inside = [(r, c) for r, c in cells if 0 <= r < rows and 0 <= c < columns]
    return all(after.cells[cell] for cell in inside if before.cells[cell])


def _points(box: Box) -> FloatArray:
    """Return points (n, 2) all over a box, world frame."""
    length, width = box.size[0], box.size[1]
    x = np.linspace(-length / 2, length / 2, 2 + int(length / SPACING))
    y = np.linspace(-width / 2, width / 2, 2 + int(width / SPACING))
    return box.pose.transform(np.column_stack([np.repeat(x, y.size), np.tile(y, x.size)]))
