# mypy: allow-untyped-calls
"""Compiled loops of path following: swept footprint.

Lethal cells that the footprint covers at the start (late marks, pose errors) do not count, so that
the robot can always leave them.
"""

from __future__ import annotations

from math import cos, floor, hypot, inf, sin
from typing import NamedTuple

import numpy as np
from numba import f8, types, u1
from numpy.typing import NDArray

from stack.kernel_cache import njit
from stack.safety.kernels import time_to_contact
from stack.types import FloatArray

LETHAL = 254
HIGHEST_PASSABLE = 252


class Ground(NamedTuple):
    """Costmap and footprint.

    Attributes:
        cells: (rows, columns) uint8 costs, Nav2's values; off the grid is free.
        resolution: side of a cell, metres.
        left: x of the outer corner of cell (0, 0), map frame, metres.
        low: y of the same corner, metres.
        body: (m, 2) points that fill the footprint, base frame, metres; at most 0.7 cells apart,
            because a coarser grid of points can miss a cell.
        corners: (n, 2) polygon, base frame; a lethal cell with its centre inside is a collision.
    """

    cells: NDArray[np.uint8]
    resolution: float
    left: float
    low: float
    body: FloatArray
    corners: FloatArray


@njit(cache=True, nogil=True)
def _holds(corners: FloatArray, x: float, y: float) -> bool:
    """Whether a polygon (n, 2) contains a point: a ray to +x crosses an odd number of edges."""
    within = False
    for i in range(corners.shape[0]):
        ay, by = corners[i - 1, 1], corners[i, 1]
        if (ay > y) != (by > y):
            ax, bx = corners[i - 1, 0], corners[i, 0]
            within ^= x < ax + (y - ay) * (bx - ax) / (by - ay)
    return within


@njit(cache=True, nogil=True)
def _first_lethal(
    ground: Ground, x: float, y: float, heading: float, known: np.ndarray, count: int, first: int
) -> tuple[int, int]:
    """Find the first footprint point, from index `first` on, over a lethal cell not in `known`.

    Returns:
        Index of the point (-1: none), and the number of the cell, row * columns + column.
    """
    cells, resolution, left, low, body, corners = ground
    c, s = cos(heading), sin(heading)
    rows, columns = cells.shape
    for i in range(first, body.shape[0]):
        px = x + c * body[i, 0] - s * body[i, 1]
        py = y + s * body[i, 0] + c * body[i, 1]
        row = floor((py - low) / resolution)
        column = floor((px - left) / resolution)
        if 0 <= row < rows and 0 <= column < columns and cells[row, column] == LETHAL:
            cx = left + (column + 0.5) * resolution - x
            cy = low + (row + 0.5) * resolution - y
            if not _holds(corners, c * cx + s * cy, c * cy - s * cx):
                continue
            number = row * columns + column
            new = True
            for j in range(count):
                if known[j] == number:
                    new = False
                    break
            if new:
                return i, number
    return -1, -1


@njit(cache=True, nogil=True)
def _covered(ground: Ground, x: float, y: float, heading: float) -> tuple[np.ndarray, int]:
    """Return the numbers of the lethal cells under the footprint, and their count."""
    known = np.empty(ground.body.shape[0], np.int64)
    count = 0
    place, cell = _first_lethal(ground, x, y, heading, known, count, 0)
    while place >= 0:
        known[count] = cell
        count += 1
        place, cell = _first_lethal(ground, x, y, heading, known, count, place + 1)
    return known, count


@njit(cache=True, nogil=True)
def sweep(
    ground: Ground, x: float, y: float, heading: float,
    linear: float, lateral: float, angular: float, horizon: float, step: float,
) -> tuple[float, int]:  # fmt: skip
    """Time for which a constant twist can be driven before the footprint covers lethal cells.

    Args:
        ground: costmap and footprint.
        x: of the base, map frame, metres.
        y: of the base, map frame, metres.
        heading: of the base, map frame, radians.
        linear: m/s forward.
        lateral: m/s to the left.
        angular: rad/s, positive to the left.
        horizon: seconds to look ahead.
        step: seconds between the checked poses.

    Returns:
        Seconds up to the last pose before the collision (inf: none within the horizon), and the
        highest passable cost under the base up to there.
    """
    cells, resolution = ground.cells, ground.resolution
    rows, columns = cells.shape
    known, count = _covered(ground, x, y, heading)
    worst = 0
    time = 0.0
    while True:
        row = floor((y - ground.low) / resolution)
        column = floor((x - ground.left) / resolution)
        if 0 <= row < rows and 0 <= column < columns:
            cost = int(cells[row, column])
            if cost <= LETHAL:
                worst = max(worst, min(cost, HIGHEST_PASSABLE))
        if time >= horizon:
            return inf, worst
        span = min(step, horizon - time)
        middle = heading + 0.5 * span * angular
        c, s = cos(middle), sin(middle)
        x += span * linear * c - span * lateral * s
        y += span * linear * s + span * lateral * c
        heading += span * angular
        place, _ = _first_lethal(ground, x, y, heading, known, count, 0)
        if place >= 0:
            return time, worst
        time += span
        if horizon - time < 1e-9:
            time = horizon


@njit(cache=True, nogil=True)
def clear_poses(
    ground: Ground, x: float, y: float, heading: float, poses: FloatArray, near: np.ndarray
) -> np.ndarray:
    """Count the poses of each motion before the footprint covers lethal cells.

    Args:
        ground: costmap and footprint.
        x: of the base now, map frame, metres.
        y: of the base now, map frame, metres.
        heading: of the base now, map frame, radians.
        poses: (n, k, 3) x, y, heading of k poses on each of n motions, map frame.
        near: (rows, columns) uint8, 0 where no lethal cell is within the footprint's radius.

    Returns:
        (n,) int64 in 0..k.
    """
    rows, columns = ground.cells.shape
    known, count = _covered(ground, x, y, heading)
    clear = np.full(poses.shape[0], poses.shape[1], np.int64)
    for i in range(poses.shape[0]):
        for j in range(poses.shape[1]):
            px, py, turned = poses[i, j]
            row = floor((py - ground.low) / ground.resolution)
            column = floor((px - ground.left) / ground.resolution)
            if 0 <= row < rows and 0 <= column < columns and near[row, column] == 0:
                continue
            place, _ = _first_lethal(ground, px, py, turned, known, count, 0)
            if place >= 0:
                clear[i] = j
                break
    return clear


@njit(cache=True, nogil=True)
def free_times(
    ground: Ground, poses: FloatArray, twists: FloatArray, horizons: FloatArray,
    seen: FloatArray, outline: FloatArray, radius: float, padding: float, slack: float,
) -> FloatArray:  # fmt: skip
    """Time for which each of n twists can be driven from each of k poses.

    Args:
        ground: costmap and footprint.
        poses: (k, 3) x, y, heading, map frame.
        twists: (n, 3) m/s forward, m/s to the left, rad/s.
        horizons: (n,) seconds to look ahead.
        seen: (p, 2) measured points, map frame, metres.
        outline: (o, 2) of the footprint, base frame, metres.
        radius: circumscribed radius of the footprint, metres.
        padding: clearance to keep to the points, metres.
        slack: metres by which a point within the padding may still come nearer.

    Returns:
        (k, n) seconds; inf: clear over the whole horizon.
    """
    free = np.empty((poses.shape[0], twists.shape[0]))
    speeds = np.empty(twists.shape[0])
    farthest = 0.0
    for j in range(twists.shape[0]):
        speeds[j] = hypot(twists[j, 0], twists[j, 1]) + abs(twists[j, 2]) * radius
        farthest = max(farthest, speeds[j] * horizons[j])
    near = np.empty_like(seen)
    for i in range(poses.shape[0]):
        x, y, heading = poses[i]
        c, s = cos(heading), sin(heading)
        count = 0
        for p in range(seen.shape[0]):
            dx, dy = seen[p, 0] - x, seen[p, 1] - y
            if hypot(dx, dy) - radius - padding <= farthest:
                near[count, 0], near[count, 1] = c * dx + s * dy, c * dy - s * dx
                count += 1
        for j in range(twists.shape[0]):
            linear, lateral, angular = twists[j]
            time, _ = sweep(
                ground, x, y, heading, linear, lateral, angular, horizons[j],
                ground.resolution / speeds[j],
            )  # fmt: skip
            contact, _ = time_to_contact(
                near[:count], outline, radius, padding, slack,
                linear, lateral, angular, min(time, horizons[j]),
            )  # fmt: skip
            free[i, j] = min(time, contact)
    return free


_PLANE = f8[:, ::1]
_GROUND = types.NamedTuple((u1[:, ::1], f8, f8, f8, _PLANE, _PLANE), Ground)
SWEEP = ((sweep, (_GROUND, *8 * (f8,))),)
"""Entry points, with the types that `SweptFootprint` calls them with."""
CLEAR_POSES = ((clear_poses, (_GROUND, f8, f8, f8, f8[:, :, ::1], u1[:, ::1])),)
FREE_TIMES = ((free_times, (_GROUND, _PLANE, _PLANE, f8[::1], _PLANE, _PLANE, f8, f8, f8)),)
