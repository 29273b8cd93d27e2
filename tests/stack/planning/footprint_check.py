"""Costs under a footprint in plain NumPy: what plans are checked with, independent of kernels."""

import numpy as np

from stack.geometry.polygons import fill_polygon
from stack.types import FREE_COST, LETHAL_COST, UNKNOWN_COST, Pose2D


def footprint_cost(grid, footprint, pose, *, unknown=UNKNOWN_COST):
    """The largest cost under the outline and its interior; `unknown` also outside the grid."""
    points = pose.transform(fill_polygon(footprint.points, 0.7 * grid.resolution))
    column, row = np.floor((points - grid.origin) / grid.resolution).astype(int).T
    rows, columns = grid.cells.shape
    on_grid = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    costs = np.full(len(points), UNKNOWN_COST)
    costs[on_grid] = grid.cells[row[on_grid], column[on_grid]]
    return int(np.where(costs == UNKNOWN_COST, unknown, costs).max())


def first_blocked(grid, points, footprint):
    """Index of the first pose of (n, 3) with a lethal cell under the footprint, or None."""
    for index, (x, y, heading) in enumerate(points):
        cost = footprint_cost(grid, footprint, Pose2D(x, y, heading), unknown=FREE_COST)
        if cost >= LETHAL_COST:
            return index
    return None
