"""Smoothers by name, for paths of points and of poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.planning.smoothers.shapes import Descent, savitzky_golay
from stack.planning.smoothing import SPACING, Smoother, resampled, unsmoothed, with_headings
from stack.types import CostGrid, FloatArray, Path

SMOOTHERS = ("simple", "savitzky_golay", "constrained", "none")
"""Values of a planner's parameter `smoother`.

simple straightens the path and rounds corners; savitzky_golay fits cubics to every seven points;
constrained weighs smoothness, clearance and curvature; none leaves the path unchanged.
"""

_GENTLE = 0.5  # m; target radius of the constrained smoother for robots that can turn in place


class PointSmoother(Protocol):
    """Smoother that turns a polyline into a path."""

    def smooth(self, costs: CostGrid, points: FloatArray, heading: float) -> Path:
        """Return a path with the ends of points (n, 2), in metres, and this last heading."""
        ...


def point_smoother(name: str, traverse: NDArray[np.int64]) -> PointSmoother:
    """Return the smoother called `name`, for planners of points.

    Args:
        name: one of SMOOTHERS.
        traverse: (256,) cost of a straight step by cell cost, 0 if impassable.
    """
    if name == "simple":
        return Smoother(traverse)
    return _Shaping(name, traverse)


def point_smoother_kernels(name: str) -> KernelTypes:
    """Return the kernels of the point smoother called `name`."""
    from stack.planning import kernels
    from stack.planning.geodesic.kernels import GEODESIC

    if name == "simple":
        return (*kernels.STRAIGHTENING, *kernels.ROUNDING, *kernels.BLOCKED, *GEODESIC)
    return () if name == "none" else (*shape_kernels(name), *kernels.BLOCKED)


@dataclass(frozen=True)
class _Shaping:
    """Smooths an evenly spaced polyline; discards the result if it crosses more obstacles."""

    name: str
    traverse: NDArray[np.int64]

    def smooth(self, costs: CostGrid, points: FloatArray, heading: float) -> Path:
        raw = resampled(points, SPACING)
        if self.name == "none":
            return unsmoothed(points, heading)
        shaped = shape(self.name, costs, raw, _GENTLE, pinned=1)
        even = resampled(shaped, SPACING)
        blocked = self._blocked(costs, even) > self._blocked(costs, raw)
        return unsmoothed(points, heading) if blocked else with_headings(even, heading)

    def _blocked(self, costs: CostGrid, points: FloatArray) -> int:
        from stack.planning import kernels

        count: Any = kernels.blocked_steps
        return int(
            count(costs.cells, self.traverse, (points - np.array(costs.origin)) / costs.resolution)
        )


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
        return Descent(radius).shape(costs, points, pinned)
    shaped = savitzky_golay(points).copy()
    shaped[:pinned], shaped[len(points) - pinned :] = points[:pinned], points[-pinned:]
    return shaped


def shape_kernels(name: str) -> KernelTypes:
    """Return the kernels that `shape` calls."""
    from stack.planning.smoothers import kernels

    return kernels.DESCENT if name == "constrained" else ()
