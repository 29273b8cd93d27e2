"""Smoothing of a path of cells into evenly spaced poses."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.types import CostGrid, FloatArray, Path

POSE_SPACING = 0.05
"""Metres between the poses of a path; the path length is rounded to a multiple of it."""

_WINDOW = 5.0  # m; length of the longest shortcut
_STRIDE = 4  # cells between the points where shortcuts may begin and end
_ROUNDING = 0.15  # m; rounding changes about this length on both sides of a corner
_SMOOTHNESS = 0.3  # share of the step to the neighbours' midpoint per iteration: stable below 0.5
_ITERATIONS = 80
_EASY = 160  # rounding may enter cells up to this cost (0.11 m beyond the inscribed radius)
_FAIRINGS = (0.15, 0.1, 0.07)  # m; likewise, after the descent: removes kinks of coarse levels
_SURCHARGE = 0.01  # fairing may add this share to the cost of the path of the descent
_LEVELS = ((0.4, 20), (0.2, 15), (0.1, 10), (POSE_SPACING, 6))
"""Metres between points and passes of the descent; coarse levels move long parts of a path."""
_STIFFNESS = 1500.0  # step cost x cells²; higher values bend less and cut corners at some cost
_ROUNDING_ERROR = 1e-6  # step cost; a path equal to the unchanged one is no dearer


@dataclass(frozen=True)
class PathCosts:
    """Costs of polylines on a costmap; points (n, 2) are in cells.

    Attributes:
        costs: map frame.
        traverse: (256,) int64, cost of a straight step by cell cost, 0 if impassable.
    """

    costs: CostGrid
    traverse: NDArray[np.int64]

    def in_cells(self, points: FloatArray) -> FloatArray:
        """Return points in metres, map frame, in cells."""
        cells: FloatArray = (points - np.array(self.costs.origin)) / self.costs.resolution
        return cells

    def in_metres(self, points: FloatArray) -> FloatArray:
        """Return points in metres, map frame."""
        metres: FloatArray = points * self.costs.resolution + np.array(self.costs.origin)
        return metres

    def of(self, points: FloatArray) -> float:
        """Return the integral of interpolated step costs along points."""
        from stack.planning.geodesic import kernels

        cost: Any = kernels.path_cost
        return float(cost(self.costs.cells, self.traverse, points))

    def blocked_steps(self, points: FloatArray) -> int:
        """Count the steps between points that cross an impassable cell."""
        from stack.planning import kernels

        count: Any = kernels.blocked_steps
        return int(count(self.costs.cells, self.traverse, points))

    def rounded(self, points: FloatArray, length: float) -> FloatArray:
        """Return points, rounded over `length` metres on both sides of a corner."""
        from stack.planning import kernels

        pull: Any = kernels.round_corners
        # A kink decays over sqrt(smoothness / data) points; `length` is that many spacings.
        weight_data = _SMOOTHNESS * (POSE_SPACING / length) ** 2
        easy = self.traverse[_EASY]
        moved: FloatArray = pull(
            self.costs.cells, self.traverse, points, weight_data, _SMOOTHNESS, easy, _ITERATIONS
        )
        return moved


def smoothed(on: PathCosts, points: FloatArray, heading: float) -> Path:
    """Straighten a path, round its corners: the smoothest collision-free one with its ends.

    The candidates in order: settled (descent of cost and bends from the rounded one) and faired
    over each of _FAIRINGS, settled, rounded, straightened, unchanged. The result is the first
    that costs no more than the unchanged path, resampled, nor than settled with _SURCHARGE, by
    interpolated cell costs, and has no more steps over impassable cells than the unchanged
    path (which has none, unless its start is occupied).

    Args:
        on: costmap.
        points: (n, 2) metres, map frame: start, cell centres, end.
        heading: heading of the last pose, radians.

    Returns:
        Poses POSE_SPACING apart; their headings follow the path.
    """
    from stack.planning import kernels

    straighten: Any = kernels.straighten
    scale, raw = on.costs.resolution, on.in_cells(points)
    spacing, window = POSE_SPACING / scale, max(1, round(_WINDOW / scale / _STRIDE))
    kept = straighten(on.costs.cells, on.traverse, raw, _STRIDE, window)
    straight = resampled(raw[kept], spacing)
    rounded = resampled(on.rounded(straight, _ROUNDING), spacing)
    settled = _settled(on, rounded)
    faired = (resampled(on.rounded(settled, length), spacing) for length in _FAIRINGS)
    allowed = on.blocked_steps(raw)
    dearest = on.of(resampled(raw, spacing)) + _ROUNDING_ERROR
    if on.blocked_steps(settled) <= allowed:
        dearest = min(dearest, (1.0 + _SURCHARGE) * on.of(settled))
    for candidate in chain(faired, (settled, rounded, straight)):
        if on.blocked_steps(candidate) <= allowed and on.of(candidate) <= dearest:
            return with_headings(on.in_metres(candidate), heading)
    return unsmoothed(points, heading)


def _settled(on: PathCosts, points: FloatArray) -> FloatArray:
    """Return points in cells after the descent of cost and bends, level by level."""
    from stack.planning.geodesic import kernels

    descend: Any = kernels.descend
    settled, scale = points, on.costs.resolution
    for spacing, passes in _LEVELS:
        settled = resampled(settled, spacing / scale)
        settled = descend(on.costs.cells, on.traverse, settled, _STIFFNESS, passes)
    return resampled(settled, POSE_SPACING / scale)


def unsmoothed(points: FloatArray, heading: float) -> Path:
    """Return the path along points (n, 2) in metres, resampled but not smoothed."""
    return with_headings(resampled(points, POSE_SPACING), heading)


def resampled(points: FloatArray, spacing: float) -> FloatArray:
    """Return (m, 2) points along the polyline (n, 2), ends included, about `spacing` apart."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(1, round(float(along[-1]) / spacing))
    at = np.linspace(0.0, along[-1], count + 1)
    even = np.column_stack([np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])])
    even[0], even[-1] = points[0], points[-1]
    return even


def with_headings(points: FloatArray, heading: float) -> Path:
    """Return poses with headings from the previous to the next point; the last is `heading`."""
    ahead = np.vstack([points[1:], points[-1:]])
    behind = np.vstack([points[:1], points[:-1]])
    x, y = (ahead - behind).T
    poses = np.column_stack([points, np.arctan2(y, x)])
    poses[-1, 2] = heading
    return Path(poses)
