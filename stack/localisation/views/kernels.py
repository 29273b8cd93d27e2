"""Compiled loops: free space that is reachable at all rival poses, and expected scans.

Grids are (rows, columns) with row 0 at the smallest y. Poses are rows of x, y, heading.
"""

from __future__ import annotations

from math import cos, floor, inf, nan, sin

import numpy as np
from numba import f4, f8, i8, njit, u1
from numpy.typing import NDArray

from stack.localisation.kernels import PLACEMENT, UNSEEN, WALL, Cells, Floats, Placement, cast
from stack.types import FloatArray

STRAIGHT, DIAGONAL = 5, 7
"""Costs of steps to the side and across, in fifths of a cell."""


@njit(cache=True, nogil=True)
def _is_free(
    occupancy: Cells, distances: Floats, placement: Placement, poses: FloatArray, x: float,
    y: float, clearance: float,
) -> bool:  # fmt: skip
    """Whether the point x, y of the base frame is free with this clearance at every pose."""
    for k in range(poses.shape[0]):
        c, s = cos(poses[k, 2]), sin(poses[k, 2])
        column = floor((poses[k, 0] + c * x - s * y - placement[1]) / placement[0])
        row = floor((poses[k, 1] + s * x + c * y - placement[2]) / placement[0])
        if row < 0 or column < 0 or row >= occupancy.shape[0] or column >= occupancy.shape[1]:
            return False
        if occupancy[row, column] != 0 or distances[row, column] < clearance:
            return False
    return True


@njit(cache=True, nogil=True)
def common_reach(
    occupancy: Cells, distances: Floats, placement: Placement, poses: FloatArray, clearance: float,
    start_radius: float, cell: float, half: int,
) -> NDArray[np.int64]:  # fmt: skip
    """Cost of the way to each cell around the robot that is free at every rival pose.

    Dijkstra's algorithm with buckets (R. Dial, 1969); a cell is examined when it is reached.

    Args:
        occupancy: 0 free, 1 occupied, 2 unknown.
        distances: to the nearest surface, metres.
        placement: of both.
        poses: (k, 3) rival poses.
        clearance: required distance to surfaces, metres.
        start_radius: around the robot free space needs no clearance, metres.
        cell: side of a cell of the result, metres.
        half: cells from the robot to the edge of the result.

    Returns:
        (2 half + 1, 2 half + 1) in fifths of a cell, row 0 at the smallest y of the base frame;
        -1 where there is no way.
    """
    size = 2 * half + 1
    cost = np.full((size, size), -1)
    known = np.zeros((size, size), dtype=np.uint8)  # 1 free, 2 not
    buckets = DIAGONAL + 1
    heads = np.full(buckets, -1)
    capacity = 8 * size * size
    cells, following = np.empty(capacity, dtype=np.int64), np.empty(capacity, dtype=np.int64)
    cells[0], following[0], heads[0], used = half * size + half, -1, 0, 1
    cost[half, half] = 0
    now, empty = 0, 0
    while empty < buckets:
        entry = heads[now % buckets]
        if entry < 0:
            now += 1
            empty += 1
            continue
        empty = 0
        heads[now % buckets] = following[entry]
        row, column = cells[entry] // size, cells[entry] % size
        if cost[row, column] != now:
            continue
        for step in range(9):
            dr, dc = step // 3 - 1, step % 3 - 1
            r, c = row + dr, column + dc
            if step == 4 or r < 0 or c < 0 or r >= size or c >= size:
                continue
            there = now + (DIAGONAL if dr != 0 and dc != 0 else STRAIGHT)
            if cost[r, c] >= 0 and cost[r, c] <= there:
                continue
            if known[r, c] == 0:
                x, y = (c - half) * cell, (r - half) * cell
                near = x * x + y * y < start_radius * start_radius
                needed = 0.0 if near else clearance
                free = _is_free(occupancy, distances, placement, poses, x, y, needed)
                known[r, c] = 1 if free else 2
            if known[r, c] == 2 or used == capacity:
                continue
            cost[r, c] = there
            cells[used], following[used] = r * size + c, heads[there % buckets]
            heads[there % buckets] = used
            used += 1
    return cost


@njit(cache=True, nogil=True)
def expected_ranges(
    occupancy: Cells, placement: Placement, sensors: FloatArray, angles: FloatArray, limit: float
) -> FloatArray:
    """Ranges (k, m) of beams of lidars at (k, 3) poses; +inf without a wall, NaN where unknown."""
    ranges = np.empty((sensors.shape[0], angles.shape[0]))
    for k in range(sensors.shape[0]):
        x, y = sensors[k, 0] - placement[1], sensors[k, 1] - placement[2]
        for i in range(angles.shape[0]):
            angle = sensors[k, 2] + angles[i]
            distance, kind = cast(occupancy, placement[0], x, y, angle, limit)
            ranges[k, i] = distance if kind == WALL else (nan if kind == UNSEEN else inf)
    return ranges


VIEWS = (
    (common_reach, (u1[:, ::1], f4[:, ::1], PLACEMENT, f8[:, ::1], f8, f8, f8, i8)),
    (expected_ranges, (u1[:, ::1], PLACEMENT, f8[:, ::1], f8[::1], f8)),
)
"""Entry points, with the types that the view planner calls them with."""
