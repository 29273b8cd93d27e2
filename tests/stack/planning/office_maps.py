"""Seeded floor plans with rooms, doors and clutter, for planner tests and benchmarks."""

import numpy as np

from stack.costmap.costmap import Costmap
from stack.costmap.parameters import CostmapParameters
from stack.streams import stream
from stack.types import FREE, OCCUPIED, CostGrid, Footprint, OccupancyGrid

RESOLUTION = 0.05


def office(side: int, seed: int) -> OccupancyGrid:
    """A square building of `side` cells: rooms of 4 to 5 m, doors of 0.9 to 1.4 m, furniture."""
    random = stream(seed, "office")
    cells = np.full((side, side), FREE, dtype=np.int8)
    cells[:2] = cells[-2:] = OCCUPIED
    cells[:, :2] = cells[:, -2:] = OCCUPIED
    room = int(random.integers(80, 101))
    walls = range(room, side - room // 2, room)
    for at in walls:
        cells[at : at + 2, :] = OCCUPIED
        cells[:, at : at + 2] = OCCUPIED
    for at in walls:
        for begin in range(0, side, room):
            for wall in (cells[at : at + 2, :], cells[:, at : at + 2].T):
                door = begin + 12 + int(random.integers(0, room - 52))
                wall[:, door : door + int(random.integers(18, 29))] = FREE
    for _ in range(side * side // 6000):
        row, column = random.integers(2, side - 2, 2)
        height, width = random.integers(4, 20, 2)
        cells[row : row + height, column : column + width] = OCCUPIED
    return OccupancyGrid(cells, RESOLUTION)


def office_costs(side: int, seed: int, radius: float = 0.22) -> CostGrid:
    """The office as a global costmap for a round robot."""
    return Costmap(CostmapParameters(), Footprint.circle(radius), office(side, seed)).grid
