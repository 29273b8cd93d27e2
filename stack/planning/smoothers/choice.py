"""Smoothers by name, for paths of points and of poses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.planning.smoothers.shapes import Descent, savitzky_golay
from stack.planning.smoothing import (
    SPACING,
    PathCosts,
    Smoother,
    resampled,
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


def point_smoother(name: str, traverse: NDArray[np.int64]) -> Smoother | _Shaping:
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
    from stack.planning.geodesic.kernels import BLENDING, GEODESIC

    if name == "simple":
        return (*kernels.STRAIGHTENING, *kernels.ROUNDING, *kernels.BLOCKED, *GEODESIC)
    return () if name == "none" else (*shape_kernels(name), *kernels.BLOCKED, *BLENDING)


@dataclass(frozen=True)
class _Shaping:
    """Smooths an evenly spaced polyline where this adds neither cost nor collisions."""

    name: str
    traverse: NDArray[np.int64]

    def smooth(self, costs: CostGrid, points: FloatArray, heading: float) -> Path:
        """Return the smoothed path, or the mix with the unsmoothed one that is no dearer.

        Candidates in order: smoothed, mixes with less and less of it, unsmoothed. The result is the
        first that costs no more than the unsmoothed path, by interpolated cell costs, and has no
        more steps over impassable cells.
        """
        if self.name == "none":
            return unsmoothed(points, heading)
        raw, on = resampled(points, SPACING), PathCosts(costs, self.traverse)
        before = on.in_cells(raw)
        after = on.in_cells(shape(self.name, costs, raw, _GENTLE, pinned=1))
        allowed, dearest = on.blocked_steps(before), on.of(before)
        for candidate in self._candidates(costs, before, after):
            even = resampled(candidate, SPACING / costs.resolution)
            if on.blocked_steps(even) <= allowed and on.of(even) <= dearest:
                return with_headings(on.in_metres(even), heading)
        return unsmoothed(points, heading)

    def _candidates(
        self, costs: CostGrid, before: FloatArray, after: FloatArray
    ) -> Iterator[FloatArray]:
        """Yield points in cells: smoothed, then mixes of both paths."""
        from stack.planning.geodesic import kernels

        blend: Any = kernels.blend
        yield after
        step = float(self.traverse[0]) * SPACING / costs.resolution
        for surcharge in _SURCHARGES:
            yield blend(costs.cells, self.traverse, before, after, surcharge * step, _SWITCH * step)


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
