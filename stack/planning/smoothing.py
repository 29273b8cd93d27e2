"""Smoothing of a path of cells into evenly spaced poses."""

from __future__ import annotations

from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.types import CostGrid, FloatArray, Path

SPACING = 0.05
"""Metres between the poses of a path; the path length is rounded to a multiple of it."""

_WINDOW = 5.0  # m; length of the longest shortcut
_STRIDE = 4  # cells between the points where shortcuts may begin and end
_ROUNDING = 0.15  # m; rounding changes about this length on both sides of a corner
_SMOOTHNESS = 0.3  # share of the step to the neighbours' midpoint per iteration: stable below 0.5
_ITERATIONS = 80
_EASY = 160  # rounding may enter cells up to this cost (0.11 m beyond the inscribed radius)
_FAIRINGS = (0.15, 0.1, 0.07)  # m; likewise, after the descent: removes kinks of coarse levels
_SURCHARGE = 0.01  # fairing may add this share to the cost of the path of the descent
_LEVELS = ((0.4, 20), (0.2, 15), (0.1, 10), (SPACING, 6))
"""Metres between points and passes of the descent; coarse levels move long parts of a path."""
_STIFFNESS = 1500.0  # step cost x cells²; higher values bend less and cut corners at some cost
_ROUNDING_ERROR = 1e-6  # step cost; a path equal to the unchanged one is no dearer


class Smoother:
    """Straighten a path where this adds no cost, round its corners and check the result.

    Args:
        traverse: (256,) int64, cost of a straight step by cell cost, 0 if impassable.
    """

    def __init__(self, traverse: NDArray[np.int64]) -> None:
        from stack.planning import kernels
        from stack.planning.geodesic import kernels as geodesic

        self._kernels: Any = kernels
        self._geodesic: Any = geodesic
        self._traverse = traverse

    def smooth(self, costs: CostGrid, points: FloatArray, heading: float) -> Path:
        """Return the smoothest collision-free path with the ends of `points`.

        The candidates in order: settled (descent of cost and bends from the rounded one) and faired
        over each of _FAIRINGS, settled, rounded, straightened, unchanged. The result is the first
        that costs no more than the unchanged path, resampled, nor than settled with _SURCHARGE, by
        interpolated cell costs, and has no more steps over impassable cells than the unchanged
        path (which has none, unless its start is occupied).

        Args:
            costs: map frame.
            points: (n, 2) metres, map frame: start, cell centres, end.
            heading: heading of the last pose, radians.

        Returns:
            Poses SPACING apart; their headings follow the path.
        """
        kernels, traverse, cells = self._kernels, self._traverse, costs.cells
        scale, origin = costs.resolution, np.array(costs.origin)
        raw = (points - origin) / scale
        window = max(1, round(_WINDOW / scale / _STRIDE))
        kept = kernels.straighten(cells, traverse, raw, _STRIDE, window)
        straight = resampled(raw[kept], SPACING / scale)
        rounded = self._rounded(cells, straight, scale, _ROUNDING)
        settled = self._settled(cells, rounded, scale)
        faired = (self._rounded(cells, settled, scale, length) for length in _FAIRINGS)
        allowed = kernels.blocked_steps(cells, traverse, raw)
        dearest = self._cost(cells, resampled(raw, SPACING / scale)) + _ROUNDING_ERROR
        if kernels.blocked_steps(cells, traverse, settled) <= allowed:
            dearest = min(dearest, (1.0 + _SURCHARGE) * self._cost(cells, settled))
        for candidate in chain(faired, (settled, rounded, straight)):
            if (
                kernels.blocked_steps(cells, traverse, candidate) <= allowed
                and self._cost(cells, candidate) <= dearest
            ):
                return with_headings(candidate * scale + origin, heading)
        return unsmoothed(points, heading)

    def _settled(self, cells: NDArray[np.uint8], points: FloatArray, scale: float) -> FloatArray:
        """Return points in cells after the descent of cost and bends, level by level."""
        settled = points
        for spacing, passes in _LEVELS:
            settled = resampled(settled, spacing / scale)
            settled = self._geodesic.descend(cells, self._traverse, settled, _STIFFNESS, passes)
        return resampled(settled, SPACING / scale)

    def _cost(self, cells: NDArray[np.uint8], points: FloatArray) -> float:
        """Return the integral of interpolated step costs along points in cells."""
        return float(self._geodesic.path_cost(cells, self._traverse, points))

    def _rounded(
        self, cells: NDArray[np.uint8], points: FloatArray, scale: float, length: float
    ) -> FloatArray:
        """Return points in cells, rounded over `length` metres on both sides of a corner."""
        # A kink decays over sqrt(smoothness / data) points; `length` is that many spacings.
        weight_data = _SMOOTHNESS * (SPACING / length) ** 2
        rounded = self._kernels.round_corners(
            cells, self._traverse, points, weight_data, _SMOOTHNESS, self._traverse[_EASY],
            _ITERATIONS,
        )  # fmt: skip
        return resampled(rounded, SPACING / scale)


def unsmoothed(points: FloatArray, heading: float) -> Path:
    """Return the path along points (n, 2) in metres, resampled but not smoothed."""
    return with_headings(resampled(points, SPACING), heading)


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
