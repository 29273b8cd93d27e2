# mypy: allow-untyped-defs, allow-untyped-calls
"""Compiled checks of the footprint for contact with lethal cells."""

from typing import NamedTuple

import numpy as np
from numba import f4, f8, i8, types, u1
from numpy.typing import NDArray

from stack.kernel_cache import njit


class CollisionGrid(NamedTuple):
    """Costmap and footprint for collision checks.

    Attributes:
        cells: (rows, columns) uint8.
        weights: (256,) cost of a metre by cell cost; 0 if impassable.
        distances: (rows, columns) float32 metres from a cell's centre to the nearest lethal one.
        geometry: (4,) origin x and y, resolution, half a cell's diagonal; metres.
        samples: (n, 2) points on and in the footprint, base frame, metres, tile by tile.
        tiles: (m, 4) middle x and y and radius of each tile's samples, metres, and the number of
            the sample behind its last one.
        reach: circumscribed radius, metres.
    """

    cells: NDArray[np.uint8]
    weights: NDArray[np.float64]
    distances: NDArray[np.float32]
    geometry: NDArray[np.float64]
    samples: NDArray[np.float64]
    tiles: NDArray[np.float64]
    reach: float


@njit(cache=True, nogil=True)
def cell_of(grid, x, y):
    """Return the row and column of a point, and whether it is on the grid."""
    origin_x, origin_y, resolution, _ = grid.geometry
    column = int(np.floor((x - origin_x) / resolution))
    row = int(np.floor((y - origin_y) / resolution))
    rows, columns = grid.cells.shape
    return row, column, 0 <= row < rows and 0 <= column < columns


@njit(cache=True, nogil=True)
def contact(grid, x, y, heading, most):
    """Return (cost of a metre at a pose, number of footprint samples in contact).

    The number is one higher if the cell of the pose is impassable. Outside the grid it is above
    the number of samples. Counting ends above `most`.
    """
    slack = grid.geometry[3]
    row, column, inside = cell_of(grid, x, y)
    if not inside:
        return 0.0, grid.samples.shape[0] + 2
    weight = grid.weights[grid.cells[row, column]]
    touching = 1 if weight == 0.0 else 0
    if grid.distances[row, column] > grid.reach + 2.0 * slack:
        return weight, touching
    cosine, sine = np.cos(heading), np.sin(heading)
    first = 0
    for tile in range(grid.tiles.shape[0]):
        forward, left, radius, end = grid.tiles[tile]
        begin, first = first, int(end)
        ahead, aside = x + cosine * forward - sine * left, y + sine * forward + cosine * left
        row, column, inside = cell_of(grid, ahead, aside)
        if inside and grid.distances[row, column] > radius + 2.0 * slack:
            continue
        if touching > most:
            break
        for sample in range(begin, first):
            forward, left = grid.samples[sample, 0], grid.samples[sample, 1]
            ahead, aside = x + cosine * forward - sine * left, y + sine * forward + cosine * left
            row, column, inside = cell_of(grid, ahead, aside)
            if inside and grid.distances[row, column] == 0.0:
                touching += 1
    return weight, touching


@njit(cache=True, nogil=True)
def sweep(grid, poses, contacts):
    """Check the footprint for collision along poses.

    Args:
        grid: costmap and footprint.
        poses: (n, 3), map frame.
        contacts: allowed value of `contact`; 0 from the first pose without contact on.

    Returns:
        (mean cost of a metre, or 0 if the footprint collides; contacts at the last pose).
    """
    total, touching = 0.0, contacts
    for index in range(poses.shape[0]):
        weight, touching = contact(
            grid, poses[index, 0], poses[index, 1], poses[index, 2], contacts
        )
        if touching > contacts:
            return 0.0, touching
        total += max(weight, grid.weights[0])
        if touching == 0:
            contacts = 0
    return total / max(poses.shape[0], 1), touching


GRID = types.NamedTuple(
    (u1[:, ::1], f8[::1], f4[:, ::1], f8[::1], f8[:, ::1], f8[:, ::1], f8), CollisionGrid
)
CONTACTS = (
    (contact, (GRID, f8, f8, f8, i8)),
    (sweep, (GRID, f8[:, ::1], i8)),
)
"""Entry points, with the types that planners of poses call them with."""
