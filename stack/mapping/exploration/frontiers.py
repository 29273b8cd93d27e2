"""Frontiers: where known free space meets unknown space, with the view and the way to each.

A cell is passable where the robot's centre can be: free, and farther from occupied cells than the
inscribed radius; unknown cells do not narrow it. The information gain of a view is the unknown area
within the sensor's reach that no known obstacle hides. Sources: B. Yamauchi, "A frontier-based
approach for autonomous exploration", CIRA 1997; H. H. González-Baños, J.-C. Latombe, "Navigation
strategies for exploring indoor environments", IJRR 2002.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, ceil, hypot

import numpy as np
from numpy.typing import NDArray

from stack.geometry.distance_transform import distances_to_zero
from stack.types import FloatArray, Frontier, OccupancyGrid, Pose2D

LONGEST = 3.0
"""Longer frontiers are split, m."""
VIEW_DISTANCE = 1.0
"""Largest distance from a frontier to the place of its view, m."""
BEHIND = 2.0
"""Unknown space that counts behind a frontier, m."""
RAYS = 90
"""Rays of a view."""

VIEWS_TRIED = 24
"""Cells near a frontier that are tried as its view."""

VIEW_SPACING = 0.3
"""Metres from an avoided view within which others are no better."""

_AS_GOOD = 0.9
"""Share of the largest gain from which on a nearer view is chosen."""

UNKNOWN_KIND, FREE_KIND, OCCUPIED_KIND = -1, 0, 1


@dataclass(frozen=True)
class FrontierParameters:
    """Which frontiers are worth a drive.

    Attributes:
        sensor_range: metres; distance at which a view shows unknown space.
        least_size: metres; shorter frontiers are gaps between beams.
        least_gain: m²; views that show less are ignored.
    """

    sensor_range: float = 6.0
    least_size: float = 0.4
    least_gain: float = 0.25


DEFAULTS = FrontierParameters()


def passable_cells(grid: OccupancyGrid, radius: float) -> NDArray[np.uint8]:
    """Return (rows, columns) uint8: 1 where a disc of `radius` metres touches no obstacle."""
    distance = distances_to_zero(~grid.occupied)
    away = distance * grid.resolution >= radius + 0.5 * grid.resolution - 1e-6
    return np.ascontiguousarray(grid.free & away, dtype=np.uint8)


def kinds_of(grid: OccupancyGrid) -> NDArray[np.int8]:
    """Return (rows, columns) int8: -1 unknown, 0 free, 1 occupied."""
    kinds = np.full(grid.cells.shape, UNKNOWN_KIND, np.int8)
    kinds[grid.free] = FREE_KIND
    kinds[grid.occupied] = OCCUPIED_KIND
    return kinds


def known_area(grid: OccupancyGrid) -> float:
    """Return the area of free and occupied cells, square metres."""
    return float(np.count_nonzero(kinds_of(grid) != UNKNOWN_KIND)) * grid.resolution**2


def frontiers_of(
    grid: OccupancyGrid, pose: Pose2D, radius: float, parameters: FrontierParameters = DEFAULTS,
    avoided: Sequence[Pose2D] = (),
) -> list[Frontier]:  # fmt: skip
    """Return the frontiers that the robot can reach and view, the nearest first.

    Args:
        grid: the map so far.
        pose: of the robot, map frame.
        radius: inscribed radius of its footprint, metres.
        parameters: which frontiers count.
        avoided: views that are not returned, nor others within VIEW_SPACING.
    """
    import cv2

    from stack.geometry.travel.kernels import travel_distances
    from stack.mapping.exploration import kernels

    if grid.cells.size == 0:  # a map that is only beginning
        return []
    kinds, passable = kinds_of(grid), passable_cells(grid, radius)
    start = _start(grid, passable, pose, radius)
    if start is None:
        return []
    tenths = travel_distances(passable, *start)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    unknown = (kinds == UNKNOWN_KIND).astype(np.uint8)
    # Free cells beside occupied ones border on unknown cells where a wall has gaps of one cell.
    near_wall = cv2.dilate((kinds == OCCUPIED_KIND).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    edge = (cv2.dilate(unknown, cross) > 0) & (kinds == FREE_KIND) & ~near_wall
    count, labels = cv2.connectedComponents(edge.astype(np.uint8), connectivity=8)
    clusters = _split(labels, count, LONGEST / grid.resolution)
    least = parameters.least_size / grid.resolution
    seeing = _reachable(grid, tenths, avoided)
    reach, depth = parameters.sensor_range / grid.resolution, BEHIND / grid.resolution
    found = []
    for cells in clusters:
        if np.ptp(cells, axis=0).max(initial=0) + 1 < least:
            continue
        views = _views(cells, seeing, kinds, VIEW_DISTANCE / grid.resolution)
        if not views.size:
            continue
        rows, columns = np.ascontiguousarray(views.T)
        gains = kernels.unknown_in_view(kinds, rows, columns, reach, depth, RAYS)
        best = int(np.argmax(gains >= _AS_GOOD * gains.max()))
        gain, (row, column) = float(gains[best]) * grid.resolution**2, views[best].tolist()
        if gain >= parameters.least_gain:
            way = float(tenths[row, column]) / 10.0 * grid.resolution
            towards = _towards(unknown, cells)
            found.append(_frontier(grid, (row, column), cells, towards, (gain, way)))
    return sorted(found, key=lambda item: (item.distance, item.pose.x, item.pose.y))


def _frontier(
    grid: OccupancyGrid, view: tuple[int, int], cells: FloatArray,
    towards: tuple[float, float], worth: tuple[float, float],
) -> Frontier:  # fmt: skip
    """Return a frontier; `towards` points to the unknown cells, `worth` is gain and distance."""
    x, y = grid.centre_of(*view)
    row, column = cells.mean(axis=0).tolist()
    seen_x, seen_y = grid.centre_of(row, column)
    gain, way = worth
    away = hypot(seen_x - x, seen_y - y)
    heading = atan2(seen_y - y, seen_x - x)
    if away < 3.0 * grid.resolution:
        heading = atan2(towards[1], towards[0])
    size = float(np.ptp(cells, axis=0).max() + 1) * grid.resolution
    return Frontier(Pose2D(x, y, heading), (seen_x, seen_y), size, gain, way)


def _towards(unknown: NDArray[np.uint8], cells: FloatArray) -> tuple[float, float]:
    """Return the sum of the (x, y) steps from the cells of a frontier to unknown cells."""
    padded = np.pad(unknown, 1)
    rows, columns = cells.astype(np.int64).T + 1
    x = padded[rows, columns + 1].astype(int) - padded[rows, columns - 1]
    y = padded[rows + 1, columns].astype(int) - padded[rows - 1, columns]
    return float(x.sum()), float(y.sum())


def _start(
    grid: OccupancyGrid, passable: NDArray[np.uint8], pose: Pose2D, radius: float
) -> tuple[int, int] | None:
    """Return the robot's cell, or the nearest passable one within its radius and two cells."""
    row, column = grid.cell_at(pose.x, pose.y)
    if grid.contains(row, column) and passable[row, column]:
        return row, column
    cells = np.argwhere(passable)
    if not cells.size:
        return None
    away = np.hypot(*(cells - (row, column)).T)
    nearest = int(np.argmin(away))
    if away[nearest] > radius / grid.resolution + 2.0:
        return None
    return int(cells[nearest, 0]), int(cells[nearest, 1])


def _split(labels: NDArray[np.int32], count: int, longest: float) -> list[FloatArray]:
    """Return the (n, 2) cells of each cluster; long ones in pieces along their main direction."""
    rows, columns = np.nonzero(labels)
    order = np.argsort(labels[rows, columns], kind="stable")
    cells = np.column_stack([rows, columns])[order].astype(np.float64)
    ends = np.searchsorted(labels[rows, columns][order], np.arange(1, count + 1), side="left")
    pieces: list[FloatArray] = []
    for cluster in np.split(cells, ends[1:]):
        if not cluster.size:
            continue
        centred = cluster - cluster.mean(axis=0)
        direction = np.linalg.eigh(centred.T @ centred)[1][:, -1]
        along = centred @ direction
        number = max(1, int(np.ceil(np.ptp(along) / longest)))
        part = np.minimum(
            ((along - along.min()) / max(np.ptp(along), 1e-9) * number).astype(int), number - 1
        )
        pieces += [cluster[part == n] for n in range(number) if (part == n).any()]
    return pieces


def _reachable(
    grid: OccupancyGrid, tenths: NDArray[np.int32], avoided: Sequence[Pose2D]
) -> NDArray[np.bool_]:
    """Return the cells (rows, columns) that can be reached, without those near avoided views."""
    import cv2

    from stack.geometry.travel.kernels import UNREACHED

    away = np.zeros(tenths.shape, np.uint8)
    for view in avoided:
        row, column = grid.cell_at(view.x, view.y)
        cv2.circle(away, (column, row), ceil(VIEW_SPACING / grid.resolution), 1, -1)
    reachable: NDArray[np.bool_] = (tenths < UNREACHED) & (away == 0)
    return reachable


def _views(
    cells: FloatArray, reachable: NDArray[np.bool_], kinds: NDArray[np.int8], farthest: float
) -> NDArray[np.int64]:
    """Return (n, 2) reachable cells that see the middle of a frontier, the nearest first."""
    from stack.mapping.exploration import kernels

    middle = cells.mean(axis=0)
    nearest = cells[np.argmin(np.hypot(*(cells - middle).T))]
    low = np.maximum(nearest - farthest, 0).astype(int)
    high = (nearest + farthest + 1).astype(int)
    reached = np.argwhere(reachable[low[0] : high[0], low[1] : high[1]]) + low
    away = np.hypot(*(reached - nearest).T)
    order = np.argsort(away, kind="stable")[: np.count_nonzero(away <= farthest)]
    near = np.ascontiguousarray(reached[order])
    seeing = near[kernels.in_sight(kinds, near, *nearest.tolist())]
    found: NDArray[np.int64] = seeing[:: max(1, len(seeing) // VIEWS_TRIED)]
    return found
