"""Passages of a map and their widths, for `treepilot doctor`.

Clearance is the distance from a free cell's centre to the edge of the nearest occupied cell. Rooms
are the connected parts of free space with a large clearance. A passage is where two rooms meet; its
width is twice the largest clearance on their common boundary (watershed: Beucher and Lantuéjoul,
1979). The widest path to a place is the path whose narrowest point is widest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stack.geometry.distance_transform import distances_to_zero
from stack.mapping import kernels
from stack.types import FloatArray, OccupancyGrid

ROOM_CLEARANCE = 0.55
"""Metres; free space with more clearance than this belongs to a room, not to a passage."""

SMALLEST_ROOM = 0.25
"""Square metres; smaller areas of such space are not rooms."""


@dataclass(frozen=True, slots=True)
class Passage:
    """Middle of the boundary of two rooms, or narrowest point of a path.

    Attributes:
        x: metres, map frame.
        y: likewise.
        width: clear width, metres; 0 if there is no path.
    """

    x: float
    y: float
    width: float


def clearance_of(grid: OccupancyGrid) -> FloatArray:
    """Return (rows, columns) metres from cell centres to the nearest cell that is not free."""
    padded = np.pad(grid.free, 1)  # cells outside the map are not free
    cells = distances_to_zero(padded)[1:-1, 1:-1]
    clearance: FloatArray = np.maximum(cells.astype(np.float64) - 0.5, 0.0) * grid.resolution
    clearance[grid.occupied] = 0.0
    return clearance


def passages_of(grid: OccupancyGrid, clearance: FloatArray) -> list[Passage]:
    """Return the passages between rooms, the narrowest first.

    Two rooms can have several: one for each connected part of their boundary.
    """
    rooms = rooms_of(grid, clearance)
    boundaries: dict[tuple[int, int], list[list[int]]] = {}
    for here, there in (
        (rooms[:-1, :], rooms[1:, :]),
        (rooms[:, :-1], rooms[:, 1:]),
    ):
        for row, column in np.argwhere((here != there) & (here > 0) & (there > 0)).tolist():
            one, other = int(here[row, column]), int(there[row, column])
            pair = (min(one, other), max(one, other))
            boundaries.setdefault(pair, []).append([row, column])
    found = []
    for cells in boundaries.values():
        for part in _connected_parts(np.array(cells)):
            wide = clearance[part[:, 0], part[:, 1]]
            row, column = part[int(wide.argmax())].tolist()
            found.append(Passage(*grid.centre_of(row, column), 2.0 * float(wide.max())))
    return sorted(found, key=lambda passage: (passage.width, passage.x, passage.y))


def _connected_parts(cells: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Split cells (n, 2) into parts of neighbours, diagonal ones included."""
    import cv2

    corner = cells.min(axis=0)
    image = np.zeros(cells.max(axis=0) - corner + 1, np.uint8)
    image[tuple((cells - corner).T)] = 1
    count, labels = cv2.connectedComponents(image, connectivity=8)
    return [np.argwhere(labels == number) + corner for number in range(1, count)]


def widest_paths(
    grid: OccupancyGrid, clearance: FloatArray, start: tuple[float, float]
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Compute for every cell the narrowest point of the widest path from the start.

    Args:
        grid: the map.
        clearance: of the map, from `clearance_of`.
        start: (x, y) metres, map frame.

    Returns:
        (rows, columns) clearance of the point in metres, 0 if unreachable; and (rows, columns) its
        flat cell index.
    """
    widest = np.zeros(clearance.shape)
    narrowest_at = np.zeros(clearance.shape, dtype=np.int64)
    row, column = grid.cell_at(*start)
    if grid.contains(row, column) and clearance[row, column] > 0.0:
        kernels.grow_widest(clearance, row * clearance.shape[1] + column, widest, narrowest_at)
    return widest, narrowest_at


def widest_path_to(
    grid: OccupancyGrid, paths: tuple[FloatArray, NDArray[np.int64]], x: float, y: float
) -> Passage:
    """Return the narrowest point of the widest path to (x, y), from that of `widest_paths`."""
    row, column = grid.cell_at(x, y)
    if not grid.contains(row, column) or paths[0][row, column] <= 0.0:
        return Passage(x, y, 0.0)
    at = divmod(int(paths[1][row, column]), grid.cells.shape[1])
    return Passage(*grid.centre_of(*at), 2.0 * float(paths[0][row, column]))


def rooms_of(grid: OccupancyGrid, clearance: FloatArray) -> NDArray[np.int64]:
    """Return the room number of each free cell, from 1; 0 for cells of no room."""
    import cv2

    cores = (clearance > ROOM_CLEARANCE).astype(np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(cores, connectivity=8)
    smallest = SMALLEST_ROOM / grid.resolution**2
    large = np.flatnonzero(stats[:, cv2.CC_STAT_AREA] >= smallest)
    numbers = np.zeros(count, np.int64)
    numbers[large] = large
    rooms: NDArray[np.int64] = np.where(cores > 0, numbers[labels], 0)
    kernels.grow_rooms(clearance, rooms)  # from wide to narrow, so that rooms meet in the narrowest
    return rooms
