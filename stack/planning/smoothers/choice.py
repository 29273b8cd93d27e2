"""Smoothers by name, for paths of points and for paths of poses."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from stack.planning.smoothers.shapes import Descent, savitzky_golay
from stack.planning.smoothing import SPACING, Smoother, resampled, unsmoothed, with_headings
from stack.types import CostGrid, FloatArray, Path

SMOOTHERS = ("simple", "savitzky_golay", "constrained", "none")
"""What a planner's parameter `smoother` may be.

simple straightens and rounds corners; savitzky_golay fits cubics to every seven points;
constrained weighs smoothness, clearance and curvature; none leaves the path as it was found.
"""

_GENTLE = 0.5  # m; radius that the constrained smoother aims at where the robot has no limit


class PointSmoother(Protocol):
    """Makes a path of a line of points."""

    def smooth(self, costs: CostGrid, points: FloatArray, heading: float) -> Path:
        """A path with the ends of points (n, 2), in metres, and a last heading."""
        ...


def point_smoother(name: str, traverse: NDArray[np.int64]) -> PointSmoother:
    """The smoother of a name, for planners of points.

    Args:
        name: one of SMOOTHERS.
        traverse: (256,) cost of a straight step by cell cost, 0 for no way.
    """
    if name == "simple":
        return Smoother(traverse)
    return _Shaping(name, traverse)


@dataclass(frozen=True)
class _Shaping:
    """Shapes an evenly spaced line and keeps the result where it is no worse than the line."""

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
    """Points (n, 2) shaped by the smoother of a name; nothing is checked.

    Args:
        name: savitzky_golay or constrained.
        costs: map frame.
        points: metres, map frame.
        radius: metres; the constrained smoother widens arcs tighter than this.
        pinned: points at each end that stay.
    """
    if name == "constrained":
        return Descent(radius).shape(costs, points, pinned)
    shaped = savitzky_golay(points).copy()
    shaped[:pinned], shaped[len(points) - pinned :] = points[:pinned], points[-pinned:]
    return shaped
