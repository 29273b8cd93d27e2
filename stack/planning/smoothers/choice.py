"""Smoothers by name, for paths of points and of poses."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from stack.compilation import KernelTypes
from stack.planning.smoothers.shapes import constrained, savitzky_golay
from stack.planning.smoothing import (
    POSE_SPACING,
    PathCosts,
    resampled,
    smoothed,
    unsmoothed,
    with_headings,
)
from stack.types import CostGrid, FloatArray, Path

SMOOTHERS = ("simple", "savitzky_golay", "constrained", "none")
"""Values of a planner's parameter `smoother`.

simple straightens the path and rounds corners; savitzky_golay fits cubics to every seven points;
constrained weighs smoothness, clearance and curvature; none leaves the path unchanged.
"""

_SURCHARGES = (0.3, 0.2, 0.1, 0.05, 0.02, 0.0)
"""Costs of an unsmoothed point in a mix, in steps between points over free cells, tried in order:
a mix keeps as much of the smoothed path as its cost allows."""
_SWITCH = 0.1
"""Cost of a change of the share in a mix, likewise: parts of both paths are long."""
_GENTLE = 0.5  # m; target radius of the constrained smoother for robots that can turn in place


def point_smoother_kernels(name: str) -> KernelTypes:
    """Return the kernels of the point smoother called `name`."""
    from stack.planning import kernels
    from stack.planning.geodesic.kernels import BLENDING, GEODESIC

    if name == "simple":
        return (*kernels.STRAIGHTENING, *kernels.ROUNDING, *kernels.BLOCKED, *GEODESIC)
    return () if name == "none" else (*shape_kernels(name), *kernels.BLOCKED, *BLENDING)


def smooth(name: str, on: PathCosts, points: FloatArray, heading: float) -> Path:
    """Return the path along points (n, 2) in metres, smoothed where this adds no cost.

    Of the smoothers other than `simple` the candidates in order are: smoothed, mixes with less and
    less of it, unsmoothed. The result is the first that costs no more than the unsmoothed path, by
    interpolated cell costs, and has no more steps over impassable cells.

    Args:
        name: one of SMOOTHERS.
        on: costmap.
        points: from start to end, map frame.
        heading: of the last pose.
    """
    if name == "simple":
        return smoothed(on, points, heading)
    if name == "none":
        return unsmoothed(points, heading)
    raw = resampled(points, POSE_SPACING)
    before = on.in_cells(raw)
    after = on.in_cells(shape(name, on.costs, raw, _GENTLE, pinned=1))
    allowed, dearest = on.blocked_steps(before), on.of(before)
    for candidate in _candidates(on, before, after):
        even = resampled(candidate, POSE_SPACING / on.costs.resolution)
        if on.blocked_steps(even) <= allowed and on.of(even) <= dearest:
            return with_headings(on.in_metres(even), heading)
    return unsmoothed(points, heading)


def _candidates(on: PathCosts, before: FloatArray, after: FloatArray) -> Iterator[FloatArray]:
    """Yield points in cells: smoothed, then mixes of both paths."""
    from stack.planning.geodesic import kernels

    blend: Any = kernels.blend
    yield after
    step = float(on.traverse[0]) * POSE_SPACING / on.costs.resolution
    for surcharge in _SURCHARGES:
        yield blend(on.costs.cells, on.traverse, before, after, surcharge * step, _SWITCH * step)


def shape(name: str, costs: CostGrid, points: FloatArray, radius: float, pinned: int) -> FloatArray:
    """Return (n, 2) points smoothed by the smoother called `name`, without a collision check.

    Args:
        name: savitzky_golay or constrained.
        costs: map frame.
        points: (n, 2) metres, map frame.
        radius: metres; the constrained smoother widens arcs tighter than this.
        pinned: number of fixed points at each end.
    """
    if name == "constrained":
        return constrained(costs, points, radius, pinned)
    shaped = savitzky_golay(points).copy()
    shaped[:pinned], shaped[len(points) - pinned :] = points[:pinned], points[-pinned:]
    return shaped


def shape_kernels(name: str) -> KernelTypes:
    """Return the kernels that `shape` calls."""
    from stack.planning.smoothers import kernels

    return kernels.DESCENT if name == "constrained" else ()
