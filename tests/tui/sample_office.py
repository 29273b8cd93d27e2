"""An office drawn by hand for the dashboard's tests: walls, doors, furniture, costs and sight."""

from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np

from stack.types import CostGrid, OccupancyGrid, Pose2D, Scan

RESOLUTION = 0.05
WIDTH, HEIGHT = 24.0, 14.0
BEAMS, RANGE_MAX = 360, 10.0

# Axis-aligned (x0, y0, x1, y1) in metres: outer walls, corridor walls with doors, room dividers.
WALLS = (
    (0.0, 0.0, 24.0, 0.15), (0.0, 13.85, 24.0, 14.0), (0.0, 0.0, 0.15, 14.0),
    (23.85, 0.0, 24.0, 14.0),
    (0.0, 5.4, 2.6, 5.5), (3.6, 5.4, 9.4, 5.5), (10.4, 5.4, 16.4, 5.5), (17.4, 5.4, 24.0, 5.5),
    (0.0, 8.4, 4.4, 8.5), (5.4, 8.4, 12.2, 8.5), (13.2, 8.4, 19.6, 8.5), (20.6, 8.4, 24.0, 8.5),
    (6.8, 0.0, 6.9, 5.5), (13.6, 0.0, 13.7, 5.5), (19.4, 0.0, 19.5, 5.5),
    (8.6, 8.4, 8.7, 14.0), (16.4, 8.4, 16.5, 14.0),
)  # fmt: skip
FURNITURE = (
    (0.6, 0.5, 2.2, 1.2), (4.9, 1.0, 5.6, 3.0), (8.4, 1.6, 11.4, 2.8), (15.0, 0.5, 16.2, 1.1),
    (17.6, 2.6, 18.4, 3.8), (21.0, 1.2, 22.6, 2.0), (22.9, 3.6, 23.6, 4.9), (1.0, 12.2, 3.4, 12.9),
    (6.4, 10.2, 7.2, 11.8), (10.4, 11.0, 13.8, 12.2), (9.2, 9.0, 9.8, 9.5),
    (18.4, 12.4, 20.4, 13.2),
    (22.2, 9.8, 23.2, 11.6), (0.5, 6.6, 0.9, 7.4), (11.0, 5.7, 12.4, 6.1),
)  # fmt: skip
PLACES = {
    "dock": Pose2D(1.6, 7.0), "kitchen": Pose2D(3.2, 3.6), "meeting_room": Pose2D(10.0, 4.0),
    "lab": Pose2D(17.0, 4.4), "office_a": Pose2D(5.0, 10.4), "office_b": Pose2D(12.8, 10.0),
    "store": Pose2D(20.2, 10.2),
}  # fmt: skip


@dataclass(frozen=True)
class Office:
    """What is fixed: the map and what it costs to drive through it."""

    grid: OccupancyGrid
    costs: CostGrid


@lru_cache(maxsize=1)
def build_office() -> Office:
    """The map (280, 480) at 5 cm and its inflated costs, row 0 at the smallest y."""
    cells = np.zeros((round(HEIGHT / RESOLUTION), round(WIDTH / RESOLUTION)), dtype=np.int8)
    for box in (*WALLS, *FURNITURE):
        left, low, right, high = (round(side / RESOLUTION) for side in box)
        cells[low:high, left:right] = 100
    free = (cells == 0).astype(np.uint8)
    distance = cv2.distanceTransform(free, cv2.DIST_L2, 5) * RESOLUTION
    costs = np.where(distance < 0.7, 252 * np.exp(-4.0 * np.maximum(distance - 0.2, 0.0)), 0)
    costs[distance < 0.2] = 253
    costs[cells == 100] = 254
    return Office(OccupancyGrid(cells, RESOLUTION), CostGrid(costs.astype(np.uint8), RESOLUTION))


def look_around(grid: OccupancyGrid, pose: Pose2D, people: np.ndarray) -> Scan:
    """A scan (360 beams) by marching half a cell at a time; people count as discs."""
    angles = -np.pi + np.arange(BEAMS) * (2 * np.pi / BEAMS)
    reach = np.arange(0.1, RANGE_MAX, RESOLUTION / 2)
    x = pose.x + reach[None, :] * np.cos(pose.heading + angles)[:, None]
    y = pose.y + reach[None, :] * np.sin(pose.heading + angles)[:, None]
    rows, columns = grid.cells.shape
    row = np.clip((y / RESOLUTION).astype(int), 0, rows - 1)
    column = np.clip((x / RESOLUTION).astype(int), 0, columns - 1)
    hit = grid.cells[row, column] == 100
    for person_x, person_y, radius in people:
        hit |= (x - person_x) ** 2 + (y - person_y) ** 2 < radius**2
    ranges = np.where(hit.any(axis=1), reach[hit.argmax(axis=1)], np.inf).astype(np.float32)
    return Scan(0.0, ranges, -np.pi, 2 * np.pi / BEAMS, 0.1, RANGE_MAX)
