"""Smoothing of a path of cells into evenly spaced poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.types import CostGrid, FloatArray, Path

SPACING = 0.05
"""Metres between the poses of a path; the path length is rounded to a multiple of it."""

_WINDOW = 5.0  # m; length of the longest shortcut
_STRIDE = 4  # cells between the points where shortcuts may begin and end
_ROUNDING = 0.3  # m; rounding changes about this length on both sides of a corner
_SMOOTHNESS = 0.3  # share of the step to the neighbours' midpoint per iteration: stable below 0.5
_ITERATIONS = 80
_EASY = 160  # rounding may enter cells up to this cost (0.11 m beyond the inscribed radius)


class Smoother:
    """Straighten a path where this adds no cost, round its corners and check the result.

    Args:
        traverse: (256,) int64, cost of a straight step by cell cost, 0 if impassable.
    """

    def __init__(self, traverse: NDArray[np.int64]) -> None:
        from stack.planning import kernels

        self._kernels: Any = kernels
        self._traverse = traverse

    def smooth(self, costs: CostGrid, points: FloatArray, heading: float) -> Path:
        """Return the smoothest collision-free path with the ends of `points`.

        The candidates in order: rounded, straightened, unchanged. The result is the first with no
        more steps over impassable cells than the unchanged path (which has none, unless its start
        is occupied).

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
        # A kink decays over sqrt(smoothness / data) points; _ROUNDING is that many spacings.
        weight_data = _SMOOTHNESS * (SPACING / _ROUNDING) ** 2
        rounded = kernels.round_corners(
            cells, traverse, straight, weight_data, _SMOOTHNESS, traverse[_EASY], _ITERATIONS
        )
        rounded = resampled(rounded, SPACING / scale)
        allowed = kernels.blocked_steps(cells, traverse, raw)
        for candidate in (rounded, straight):
            if kernels.blocked_steps(cells, traverse, candidate) <= allowed:
                return with_headings(candidate * scale + origin, heading)
        return unsmoothed(points, heading)


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
