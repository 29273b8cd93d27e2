"""The floor on which people walk: distance to the nearest obstacle, and the ways to goals."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stack.geometry.distance_transform import distances_to_zero
from stack.sim.worlds.rasterise import covered_cells
from stack.sim.worlds.world import World
from stack.types import FloatArray

RESOLUTION = 0.1
"""Side of a cell, metres; larger in worlds of more than MAX_CELLS cells."""

MAX_CELLS = 1_000_000

CLEARANCE = 0.5
"""Distance to walls, metres, that people like to keep; nearer they would rather go round."""


class Floor:
    """Distances and walking times over the bounds of a world, with its doors open.

    Attributes:
        resolution: side of a cell, metres.
        origin: outer corner of cell (0, 0), metres.
        distance: (rows, columns) from the middle of each cell to the nearest obstacle, metres.
    """

    def __init__(self, world: World) -> None:
        x_min, y_min, x_max, y_max = world.bounds
        area = (x_max - x_min) * (y_max - y_min)
        self.resolution = max(RESOLUTION, (area / MAX_CELLS) ** 0.5)
        self.origin = (x_min, y_min)
        covered = covered_cells(world, self.resolution)
        covered[[0, -1], :] = covered[:, [0, -1]] = True  # nobody leaves the world
        cells = distances_to_zero(~covered)
        self.distance = (cells * self.resolution).astype(np.float32)

    def times_to(self, x: float, y: float, radius: float) -> NDArray[np.float32]:
        """Return the walking times to a point, relative to a speed of 1 m/s.

        Near walls people walk less fast, so that ways lead through the middle of doors.

        Returns:
            (rows, columns) seconds; inf where there is no way for a person of that radius.
        """
        from stack.sim.people.kernels import sweep_times  # imports numba

        distance = self.distance.astype(np.float64)
        near = np.clip((CLEARANCE - distance) / CLEARANCE, 0.0, 1.0)
        pace: FloatArray = np.where(distance > radius, 1.0 + 2.0 * near, np.inf)
        row, column = self.cell_at(x, y)
        times = np.full(pace.shape, np.inf)
        times[row, column] = 0.0
        pace[row, column] = min(pace[row, column], 3.0)
        sweep_times(times, np.ascontiguousarray(pace), self.resolution)
        return times.astype(np.float32)

    def cell_at(self, x: float, y: float) -> tuple[int, int]:
        """Return the row and column of the cell at a point, or of the nearest one."""
        rows, columns = self.distance.shape
        row = int((y - self.origin[1]) / self.resolution)
        column = int((x - self.origin[0]) / self.resolution)
        return min(max(row, 0), rows - 1), min(max(column, 0), columns - 1)
