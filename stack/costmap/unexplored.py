"""The costmap's ground when there is no map: unknown everywhere, and growing where it is needed."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from math import ceil, floor
from typing import Protocol

import numpy as np

from stack.errors import ParameterError
from stack.types import UNKNOWN, OccupancyGrid, Pose2D

MARGIN = 12.0
"""Metres of unknown ground round every place the robot is asked to go: room for detours."""

NEAR_EDGE = 6.0
"""Metres to the edge of the ground below which it grows."""

STEP = 4.0
"""Metres; the ground's edges lie on multiples of this, so that it grows seldom."""

MAX_CELLS = 4096 * 4096


def unexplored(poses: Iterable[Pose2D], resolution: float) -> OccupancyGrid:
    """Unknown ground MARGIN metres round some poses (at least one).

    Raises:
        ParameterError: the poses lie so far apart that the grid would be too large.
    """
    places = np.array([(pose.x, pose.y) for pose in poses])
    low, high = places.min(axis=0) - MARGIN, places.max(axis=0) + MARGIN
    return _ground((*low, *high), resolution)


class Growable(Protocol):
    """A costmap whose ground can be replaced by a larger one."""

    def set_static(self, static: OccupancyGrid) -> None:
        """Take another ground; what was sensed keeps its place."""
        ...


class Ground:
    """Unknown ground under costmaps that grows so that no place asked for is outside."""

    def __init__(self, grid: OccupancyGrid, costmaps: Iterable[Growable]) -> None:
        """Begin with a grid, which the costmaps have already."""
        self.grid, self._costmaps = grid, tuple(costmaps)

    def cover(self, poses: Iterable[Pose2D]) -> None:
        """Grow where a pose lies outside or nearer than NEAR_EDGE to the edge.

        A place so far away that the grid would be too large stays outside, where a plan fails
        with GOAL_OUTSIDE_MAP.
        """
        rows, columns = self.grid.cells.shape
        x_min, y_min = self.grid.origin
        x_max = x_min + columns * self.grid.resolution
        y_max = y_min + rows * self.grid.resolution
        wanted = [x_min, y_min, x_max, y_max]
        for pose in poses:
            if pose.x - x_min < NEAR_EDGE or pose.y - y_min < NEAR_EDGE:
                wanted[:2] = min(wanted[0], pose.x - MARGIN), min(wanted[1], pose.y - MARGIN)
            if x_max - pose.x < NEAR_EDGE or y_max - pose.y < NEAR_EDGE:
                wanted[2:] = max(wanted[2], pose.x + MARGIN), max(wanted[3], pose.y + MARGIN)
        if wanted == [x_min, y_min, x_max, y_max]:
            return
        with suppress(ParameterError):
            self.grid = _ground((wanted[0], wanted[1], wanted[2], wanted[3]), self.grid.resolution)
            for costmap in self._costmaps:
                costmap.set_static(self.grid)


def _ground(bounds: tuple[float, float, float, float], resolution: float) -> OccupancyGrid:
    """A grid over bounds widened to multiples of STEP, with corners on the resolution's lattice."""
    step = max(1, round(STEP / resolution)) * resolution
    left, low = (floor(edge / step + 1e-9) for edge in bounds[:2])
    right, high = (ceil(edge / step - 1e-9) for edge in bounds[2:])
    side = round(step / resolution)
    rows, columns = (high - low) * side, (right - left) * side
    if rows * columns > MAX_CELLS:
        raise ParameterError(
            "map",
            f"without a map, places {step * max(right - left, high - low):.0f} m apart need "
            f"{rows * columns} cells of {resolution:g} m, at most {MAX_CELLS} fit",
            "use a larger costmap resolution or nearer goals",
        )
    cells = np.full((rows, columns), UNKNOWN, dtype=np.int8)
    return OccupancyGrid(cells, resolution, (left * step, low * step))
