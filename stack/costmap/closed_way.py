"""Where the shortest way of the map is closed by something that is not on the map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.geometry.connected import connected_to
from stack.geometry.distance_transform import distances_to_zero
from stack.types import LETHAL_COST, UNKNOWN_COST, CostGrid, Pose2D

Cell = tuple[int, int]

MOST_CELLS = 1 << 24
"""Largest grid that is searched: 100 x 100 m at 2.5 cm take about a second."""

REACH = 0.5
"""Metres within which a start or goal that is too close to an obstacle begins at a free place."""


@dataclass(frozen=True, slots=True)
class ClosedWay:
    """A place at which the shortest way of the map is closed.

    Attributes:
        at: (x, y) of what closes it, map frame, metres.
        open_length: metres of the way before it; length: of the whole way.
    """

    at: tuple[float, float]
    open_length: float
    length: float


def closed_way(
    costs: CostGrid, ground: NDArray[np.uint8], start: Pose2D, goal: Pose2D, radius: float
) -> ClosedWay | None:
    """Return where the way between two places is closed that is open on the map.

    Args:
        costs: map frame.
        ground: (rows, columns) costs of the map alone.
        start: map frame.
        goal: map frame.
        radius: clearance of the robot's centre from lethal cells, metres.

    Returns:
        None if the map has no way either, nothing closes it, or there are too many cells.
    """
    if costs.cells.size > MOST_CELLS:
        return None
    mapped = (ground == LETHAL_COST) | (ground == UNKNOWN_COST)
    on_map = _clear_of(mapped, radius / costs.resolution)
    now = on_map & _clear_of(costs.cells == LETHAL_COST, radius / costs.resolution)
    ends = [_free_cell(costs, on_map, pose) for pose in (start, goal)]
    if ends[0] is None or ends[1] is None:
        return None
    way = _way(on_map, ends[0], ends[1])
    near = _free_cell(costs, now, start)
    reached = np.zeros_like(now) if near is None else connected_to(now, [near])
    closed = [number for number, cell in enumerate(way) if not reached[cell]]
    if not way or not closed or reached[way[-1]]:
        return None
    blocked = (costs.cells == LETHAL_COST) & ~_grown(mapped)
    at = _nearest(blocked, way[closed[0]])
    side = costs.resolution
    return ClosedWay(costs.centre_of(*at), closed[0] * side, len(way) * side)


def _clear_of(occupied: NDArray[np.bool_], cells: float) -> NDArray[np.bool_]:
    clear: NDArray[np.bool_] = distances_to_zero(~occupied) > cells + 1e-9
    return clear


def _grown(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells, and those within two cells of them: what a scan sees of them."""
    return ~_clear_of(cells, 2.0)


def _free_cell(costs: CostGrid, free: NDArray[np.bool_], pose: Pose2D) -> Cell | None:
    """Return the free cell nearest to a pose, within REACH."""
    (row, column), reach = costs.cell_at(pose.x, pose.y), int(REACH / costs.resolution)
    if not costs.contains(row, column):
        return None
    top, left = max(row - reach, 0), max(column - reach, 0)
    around = free[top : row + reach + 1, left : column + reach + 1]
    if not around.any():
        return None
    near = _nearest(around, (row - top, column - left))
    return near[0] + top, near[1] + left


def _nearest(cells: NDArray[np.bool_], to: Cell) -> Cell:
    """Return the cell nearest to another one; that one if there is none."""
    rows, columns = np.nonzero(cells)
    if not len(rows):
        return to
    best = int(np.hypot(rows - to[0], columns - to[1]).argmin())
    return int(rows[best]), int(columns[best])


def _way(free: NDArray[np.bool_], start: Cell, goal: Cell) -> list[Cell]:
    """Return the cells of a shortest way over free cells; empty if there is none."""
    from stack.geometry.travel import kernels

    travel: Any = kernels.travel_distances
    away = travel(free.astype(np.uint8), *goal)
    if away[start] == kernels.UNREACHED:
        return []
    way = [start]
    while way[-1] != goal:
        row, column = way[-1]
        top, left = max(row - 1, 0), max(column - 1, 0)
        around = away[top : row + 2, left : column + 2].astype(np.int64)
        around[around == kernels.UNREACHED] = np.iinfo(np.int64).max
        step = np.unravel_index(int(around.argmin()), around.shape)
        way.append((top + int(step[0]), left + int(step[1])))
        if away[way[-1]] >= away[row, column]:
            return []
    return way
