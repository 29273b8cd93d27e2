"""Which places of a world the robot can reach from its start."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from math import hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import Frame
from stack.drivetrain.description import RobotDescription
from stack.geometry.connected import Cell, connected_to
from stack.geometry.polygons import widest_disc
from stack.sim.worlds.rasterise import RESOLUTION, cells_near, map_shape
from stack.sim.worlds.world import World
from stack.types import FloatArray, Footprint, Pose2D

MAX_CELLS = 1_000_000
"""Larger worlds have larger cells, in which fewer passages count as closed."""
ROOM = 0.06
"""Free distance, metres, around the robot at suggested places: no tight fit, also if rounded."""


class ReachableFloor:
    """The floor that the largest disc in the robot's outline reaches from the start.

    Walls, boxes and cylinders count, except boxes above the robot. Doors are open, and people and
    drops do not count. Where the timeline moves the robot, it may be too. A passage that is
    wide enough never counts as closed; one that is up to a cell's diagonal too narrow may be open.

    Args:
        world: world as it is.
        robot: its footprint and height count.
        start: world frame.
        closed: areas that are closed by a rule: a function that returns the cells within metres of
            the area, and the metres by which it is larger to the robot than an obstacle. A robot
            that starts in one leaves it to the nearest place outside.
    """

    def __init__(
        self, world: World, robot: RobotDescription, start: Pose2D,
        closed: Sequence[tuple[Callable[[Frame, float], NDArray[np.bool_]], float]] = (),
    ) -> None:  # fmt: skip
        low = tuple(box for box in world.boxes if box.elevation < robot.height)
        self._world, self._footprint = replace(world, boxes=low), robot.footprint
        x, y, self._radius = _widest_disc(robot.footprint)
        self._middle = Pose2D(x, y)
        x_min, y_min, x_max, y_max = world.bounds
        area = (x_max - x_min) * (y_max - y_min)
        self._resolution = max(RESOLUTION, sqrt(area / MAX_CELLS))
        self._shape = map_shape(world, self._resolution)
        # A point of a way is at most half a diagonal from the middle of its cell.
        spare = self._resolution / sqrt(2.0)
        starts = [start, *(event.move_robot for event in world.timeline if event.move_robot)]
        self._areas = closed
        free = self._free(self._radius - spare)
        begins = self._cells_of(starts)
        if closed and free.any():
            begins = [self._left(cell, free) for cell in begins]
        self._reached = connected_to(free, begins)

    def reaches(self, pose: Pose2D, tolerance: float) -> bool:
        """Return whether the robot can get to within a distance of a pose, metres.

        From a start in an obstacle everything counts as reachable.
        """
        if self._reached[self._cells_of([pose])[0]] or not self._reached_xy.size:
            return True
        middle = pose.compose(self._middle)
        x, y = _nearest(self._reached_xy, middle)
        return hypot(x - middle.x, y - middle.y) <= tolerance + self._resolution / sqrt(2.0)

    def nearest(self, pose: Pose2D) -> tuple[float, float]:
        """Return the reachable place nearest to a pose, metres, with room to turn if possible."""
        return _nearest(self._roomy_xy, pose)

    @cached_property
    def _reached_xy(self) -> FloatArray:
        return self._middles_of(self._reached)

    @cached_property
    def _roomy_xy(self) -> FloatArray:
        roomy = self._reached & self._free(self._footprint.circumscribed_radius + ROOM)
        return self._middles_of(roomy) if roomy.any() else self._reached_xy

    def _free(self, clearance: float) -> NDArray[np.bool_]:
        free = ~self._closed(clearance)
        if clearance > 0.0:
            free &= ~cells_near(self._world, self._resolution, clearance)
        return free

    def _closed(self, clearance: float) -> NDArray[np.bool_]:
        """Return the cells within metres of an area that is closed by a rule."""
        frame = Frame(self._shape, self._resolution, self._world.bounds[:2])
        closed = np.zeros(self._shape, dtype=np.bool_)
        for cells, more in self._areas:
            closed |= cells(frame, max(clearance + more, 0.0))
        return closed

    def _left(self, cell: Cell, free: NDArray[np.bool_]) -> Cell:
        """Return the free cell nearest to one in a closed area; other cells unchanged."""
        if free[cell] or not self._closed(self._radius)[cell]:
            return cell
        rows, columns = np.nonzero(free)
        nearest = int(np.argmin((rows - cell[0]) ** 2 + (columns - cell[1]) ** 2))
        return int(rows[nearest]), int(columns[nearest])

    def _cells_of(self, poses: Sequence[Pose2D]) -> list[Cell]:
        """Return the cell of the disc's middle at each pose, or the nearest one."""
        rows, columns = self._shape
        x_min, y_min = self._world.bounds[:2]
        found = []
        for pose in (base.compose(self._middle) for base in poses):
            row = int((pose.y - y_min) // self._resolution)
            column = int((pose.x - x_min) // self._resolution)
            found.append((min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)))
        return found

    def _middles_of(self, cells: NDArray[np.bool_]) -> FloatArray:
        """Return the middles of some cells, (n, 2) metres."""
        rows, columns = np.nonzero(cells)
        middles = np.column_stack([columns, rows]) + 0.5
        found: FloatArray = middles * self._resolution + self._world.bounds[:2]
        return found


def _widest_disc(footprint: Footprint) -> tuple[float, float, float]:
    """Return (x, y, radius) of the widest disc in an outline, without a search where it is known.

    No disc is wider than the outline: one about the base that is as wide is the widest.
    """
    inscribed = footprint.inscribed_radius
    if footprint.half_width <= inscribed:
        return 0.0, 0.0, inscribed
    return widest_disc(footprint.points)


def _nearest(points: FloatArray, pose: Pose2D) -> tuple[float, float]:
    """Return the point nearest to a pose among some (n, 2), n > 0."""
    offsets = points - (pose.x, pose.y)
    x, y = points[np.argmin(np.einsum("ij,ij->i", offsets, offsets))]
    return float(x), float(y)
