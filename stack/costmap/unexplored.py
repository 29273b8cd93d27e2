"""Unknown grid under the costmaps when there is no map; it grows with the goals."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from math import ceil, floor

import numpy as np
from numpy.typing import NDArray

from stack.costmap.costmap import Costmap
from stack.costmap.layer import picked
from stack.errors import ParameterError
from stack.mapping.limits import MAX_UNEXPLORED
from stack.types import UNKNOWN, OccupancyGrid, Pose2D

MARGIN = 12.0
"""Metres of unknown cells around every requested pose: room for detours."""

NEAR_EDGE = 6.0
"""Distance in metres from a pose to the edge of the grid below which the grid grows."""

EDGE_STEP = 4.0
"""Metres; the grid's edges lie on multiples of this, so that it rarely grows."""


def unexplored(poses: Iterable[Pose2D], resolution: float) -> OccupancyGrid:
    """Return an unknown grid that reaches MARGIN metres beyond some poses (at least one).

    Raises:
        ParameterError: the poses are so far apart that the grid would be too large.
    """
    positions = np.array([(pose.x, pose.y) for pose in poses])
    low, high = positions.min(axis=0) - MARGIN, positions.max(axis=0) + MARGIN
    return _ground((*low, *high), resolution)


class GrowingMap:
    """Unknown grid of costmaps without a map; grows to contain every requested pose."""

    def __init__(self, grid: OccupancyGrid, costmaps: Iterable[Costmap]) -> None:
        """Start with a grid that the costmaps already use."""
        self.grid, self._costmaps = grid, tuple(costmaps)
        self._drawn: OccupancyGrid | None = None

    def draw(self, drawn: OccupancyGrid) -> None:
        """Show a map that the robot draws: it replaces the last one; the grid does not shrink."""
        self._drawn = drawn
        self._show()

    def _show(self) -> None:
        if self._drawn is not None:
            cells = _sampled(self._drawn, self.grid)
            self.grid = OccupancyGrid(cells, self.grid.resolution, self.grid.origin)
        for costmap in self._costmaps:
            costmap.set_static(self.grid)

    def cover(self, poses: Iterable[Pose2D]) -> None:
        """Grow when a pose lies outside or nearer than NEAR_EDGE to the edge.

        If the grid would be too large, it does not grow; a plan to the pose then fails with
        GOAL_OUTSIDE_MAP.
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
            self._show()


def resampled_grid(grid: OccupancyGrid, resolution: float) -> OccupancyGrid:
    """Return a map in cells of another size; the same object if the size is the same."""
    if abs(grid.resolution - resolution) < 1e-9:
        return grid
    rows, columns = (ceil(n * grid.resolution / resolution - 1e-9) for n in grid.cells.shape)
    finer = OccupancyGrid(np.full((rows, columns), UNKNOWN, np.int8), resolution, grid.origin)
    return OccupancyGrid(_sampled(grid, finer), resolution, grid.origin, grid.occupied_from)


def _sampled(drawn: OccupancyGrid, grid: OccupancyGrid) -> NDArray[np.int8]:
    """Return the values of a map at the cell centres of a grid; unknown outside it."""
    rows, columns = (
        np.floor(
            (grid.origin[axis] - drawn.origin[axis] + (np.arange(count) + 0.5) * grid.resolution)
            / drawn.resolution
        ).astype(np.int64)
        for axis, count in ((1, grid.cells.shape[0]), (0, grid.cells.shape[1]))
    )
    return picked(drawn.cells, rows, columns, UNKNOWN)


def _ground(bounds: tuple[float, float, float, float], resolution: float) -> OccupancyGrid:
    """Return a grid over bounds widened to multiples of EDGE_STEP, aligned to the resolution."""
    step = max(1, round(EDGE_STEP / resolution)) * resolution
    left, low = (floor(edge / step + 1e-9) for edge in bounds[:2])
    right, high = (ceil(edge / step - 1e-9) for edge in bounds[2:])
    side = round(step / resolution)
    rows, columns = (high - low) * side, (right - left) * side
    if rows * columns > MAX_UNEXPLORED:
        raise ParameterError(
            "map",
            f"without a map, poses {step * max(right - left, high - low):.0f} m apart need "
            f"{rows * columns} cells of {resolution:g} m; the limit is {MAX_UNEXPLORED}",
            "use a larger costmap resolution or nearer goals",
        )
    cells = np.full((rows, columns), UNKNOWN, dtype=np.int8)
    return OccupancyGrid(cells, resolution, (left * step, low * step))
