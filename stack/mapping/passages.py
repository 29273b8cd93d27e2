"""Doors and passages of a map, and what fits through: the numbers behind `treepilot doctor`.

Clearance is the distance of a free cell's middle to the nearest occupied cell's edge. Rooms are the
parts of free space that stay connected where the clearance is large; a passage is where two of them
meet, and its width is twice the clearance at the widest point of the seam (watershed: Beucher and
Lantuéjoul, 1979). The widest way to a place is the path whose narrowest point is widest.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush

import numpy as np
from numpy.typing import NDArray

from stack.types import FREE, OCCUPIED, FloatArray, OccupancyGrid

ROOM_CLEARANCE = 0.55
"""Metres: free space with more clearance than this belongs to a room, not to a passage."""

SMALLEST_ROOM = 0.25
"""Square metres of such space below which it is no room."""


@dataclass(frozen=True, slots=True)
class Passage:
    """Where two rooms meet: the middle (metres, map frame) and the clear width (metres)."""

    x: float
    y: float
    width: float


@dataclass(frozen=True, slots=True)
class Way:
    """The widest way from a start to a place.

    Attributes:
        width: of its narrowest point, metres; 0 when nothing joins the two.
        x: of that point, metres, map frame.
        y: likewise.
    """

    width: float
    x: float
    y: float


def clearance_of(grid: OccupancyGrid) -> FloatArray:
    """(rows, columns) metres from each cell's middle to the nearest occupied or unknown cell."""
    import cv2

    free = (grid.cells == FREE).astype(np.uint8)
    padded = np.pad(free, 1)  # outside the map nothing is free
    cells = cv2.distanceTransform(padded, cv2.DIST_L2, cv2.DIST_MASK_PRECISE)[1:-1, 1:-1]
    clearance: FloatArray = np.maximum(cells.astype(np.float64) - 0.5, 0.0) * grid.resolution
    clearance[grid.cells == OCCUPIED] = 0.0
    return clearance


def passages_of(grid: OccupancyGrid, clearance: FloatArray) -> list[Passage]:
    """Every passage between two rooms, the narrowest first."""
    rooms = _rooms(grid, clearance)
    best: dict[tuple[int, int], tuple[float, int, int]] = {}
    for here, there in (
        (rooms[:-1, :], rooms[1:, :]),
        (rooms[:, :-1], rooms[:, 1:]),
    ):
        for row, column in np.argwhere((here != there) & (here > 0) & (there > 0)):
            one, other = int(here[row, column]), int(there[row, column])
            pair = (min(one, other), max(one, other))
            wide = float(clearance[row, column])
            if wide > best.get(pair, (-1.0, 0, 0))[0]:
                best[pair] = (wide, int(row), int(column))
    found = [
        Passage(*grid.centre_of(row, column), 2.0 * wide) for wide, row, column in best.values()
    ]
    return sorted(found, key=lambda passage: (passage.width, passage.x, passage.y))


def widest_ways(
    grid: OccupancyGrid, clearance: FloatArray, start: tuple[float, float]
) -> tuple[FloatArray, NDArray[np.int64]]:
    """For every cell the clearance of the narrowest point on the widest way from the start.

    Returns:
        (rows, columns) metres, 0 where nothing leads; and (rows, columns) flat index of that point.
    """
    rows, columns = clearance.shape
    widest = np.zeros(clearance.shape)
    narrowest_at = np.zeros(clearance.shape, dtype=np.int64)
    row, column = grid.cell_at(*start)
    if not grid.contains(row, column) or clearance[row, column] <= 0.0:
        return widest, narrowest_at
    widest[row, column] = clearance[row, column]
    narrowest_at[row, column] = row * columns + column
    queue = [(-float(clearance[row, column]), row, column)]
    while queue:
        negative, row, column = heappop(queue)
        if -negative < widest[row, column]:
            continue
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            r, c = row + down, column + right
            if not (0 <= r < rows and 0 <= c < columns):
                continue
            through = min(widest[row, column], clearance[r, c])
            if through > widest[r, c]:
                widest[r, c] = through
                narrower = clearance[r, c] < widest[row, column]
                narrowest_at[r, c] = r * columns + c if narrower else narrowest_at[row, column]
                heappush(queue, (-float(through), r, c))
    return widest, narrowest_at


def way_to(
    grid: OccupancyGrid, ways: tuple[FloatArray, NDArray[np.int64]], x: float, y: float
) -> Way:
    """The widest way to a place, from what `widest_ways` found."""
    row, column = grid.cell_at(x, y)
    if not grid.contains(row, column) or ways[0][row, column] <= 0.0:
        return Way(0.0, x, y)
    at = divmod(int(ways[1][row, column]), grid.cells.shape[1])
    return Way(2.0 * float(ways[0][row, column]), *grid.centre_of(*at))


def _rooms(grid: OccupancyGrid, clearance: FloatArray) -> NDArray[np.int32]:
    """Room numbers from 1 on every free cell that some room's basin holds; 0 elsewhere."""
    import cv2

    cores = (clearance > ROOM_CLEARANCE).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(cores, connectivity=8)
    smallest = SMALLEST_ROOM / grid.resolution**2
    rows, columns = clearance.shape
    rooms = np.zeros((rows, columns), dtype=np.int32)
    queue: list[tuple[float, int, int, int]] = []
    for label in range(1, count):
        if stats[label, cv2.CC_STAT_AREA] >= smallest:
            for at in np.argwhere(labels == label):
                row, column = int(at[0]), int(at[1])
                queue.append((-float(clearance[row, column]), row, column, label))
    queue.sort()
    while queue:  # flood from the widest cells down, so that basins meet in the narrowest ones
        _, row, column, label = heappop(queue)
        if rooms[row, column]:
            continue
        rooms[row, column] = label
        for down, right in ((0, 1), (1, 0), (0, -1), (-1, 0)):
            r, c = row + down, column + right
            if 0 <= r < rows and 0 <= c < columns and not rooms[r, c] and clearance[r, c] > 0.0:
                heappush(queue, (-float(clearance[r, c]), r, c, label))
    return rooms
