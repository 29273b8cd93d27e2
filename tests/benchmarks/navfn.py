"""Reference planner: paths down a navigation function, as NavFn plans them.

After K. Konolige, "A gradient method for realtime robot control", IROS 2000: a potential grows from
the goal by the cost of the cells, interpolated between two neighbours, and the path follows its
negative gradient, interpolated between cells, in steps of half a cell. Costs are weighed as Nav2's
NavFn does: 50 + 0.8 cost. Written from the paper, for comparison only.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from stack.planning.smoothing import resampled
from stack.sim.people.kernels import sweep_times
from stack.types import INSCRIBED_COST, CostGrid, FloatArray, Pose2D

NEUTRAL, FACTOR = 50.0, 0.8
"""Cost of a free cell, and of each unit of cost above it."""

STRIDE = 0.5
"""Length of a step along the gradient, cells."""

FINE = 0.01
"""Metres between the points at which costs are summed."""


def path_cost(costs: CostGrid, points: FloatArray) -> float:
    """Return the line integral of 1 + 3 c / 252 along points (n, 2), map frame, in metres."""
    fine = resampled(np.ascontiguousarray(points[:, :2]), FINE)
    middles = 0.5 * (fine[1:] + fine[:-1])
    column, row = np.floor((middles - np.array(costs.origin)) / costs.resolution).astype(int).T
    under = np.minimum(costs.cells[row, column].astype(np.float64), 252.0)
    steps = np.hypot(*np.diff(fine, axis=0).T)
    return float(steps @ (1.0 + 3.0 * under / 252.0))


def navfn_path(costs: CostGrid, start: Pose2D, goal: Pose2D) -> FloatArray | None:
    """Return points (n, 2), map frame, from start to goal; None if the gradient leads nowhere.

    Args:
        costs: map frame.
        start: in a passable cell.
        goal: in a passable cell.
    """
    pace = np.where(costs.cells < INSCRIBED_COST, NEUTRAL + FACTOR * costs.cells, np.inf)
    potential = np.full(pace.shape, np.inf)
    row, column = costs.cell_at(goal.x, goal.y)
    potential[row, column] = 0.0
    sweep_times(potential, np.ascontiguousarray(pace), 1.0)
    if not np.isfinite(potential[costs.cell_at(start.x, start.y)]):
        return None
    origin, scale = np.array(costs.origin), costs.resolution
    target = (np.array([goal.x, goal.y]) - origin) / scale
    point = (np.array([start.x, start.y]) - origin) / scale
    points = [point]
    slope = _gradients(potential)
    for _ in range(20 * sum(pace.shape)):
        if np.hypot(*(target - point)) < 1.0:
            return np.array([*points, target]) * scale + origin
        point = _next(potential, slope, point)
        points.append(point)
    return None


def _gradients(potential: FloatArray) -> FloatArray:
    """Return the descent (rows, columns, 2) of unit length; 0 where a cell has no lower neighbour.

    Beside an unreached cell the difference is one-sided.
    """
    parts = []
    for axis in (1, 0):
        with np.errstate(invalid="ignore"):  # inf - inf: neither cell is reached
            after = np.roll(potential, -1, axis) - potential
            before = potential - np.roll(potential, 1, axis)
        both = np.stack([before, after])
        known = np.isfinite(both)
        summed = np.where(known, both, 0.0).sum(axis=0)
        parts.append(-summed / np.maximum(known.sum(axis=0), 1))
    slope = np.stack(parts, axis=-1)
    length = np.hypot(slope[..., 0], slope[..., 1])
    unit: FloatArray = slope / np.maximum(length, 1e-9)[..., None]
    unit[~np.isfinite(potential)] = 0.0
    return unit


def _next(potential: FloatArray, slope: FloatArray, point: FloatArray) -> FloatArray:
    """Return the point half a cell further down; at a dead end the lowest neighbouring centre."""
    column, row = np.floor(point - 0.5).astype(int)
    x, y = point - 0.5 - (column, row)
    weights = np.array([[(1 - y) * (1 - x), (1 - y) * x], [y * (1 - x), y * x]])
    down = (weights[..., None] * slope[row : row + 2, column : column + 2]).sum(axis=(0, 1))
    length = float(np.hypot(*down))
    here_row, here_column = int(point[1]), int(point[0])
    if length > 1e-6:
        moved: FloatArray = point + STRIDE * down / length
        if np.isfinite(potential[int(moved[1]), int(moved[0])]):
            return moved
    around = [(here_row + i, here_column + j) for i, j in product((-1, 0, 1), repeat=2)]
    low = min(around, key=lambda cell: float(potential[cell]))
    return np.array([low[1] + 0.5, low[0] + 0.5])
