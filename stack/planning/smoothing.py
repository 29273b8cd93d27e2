"""From a path of cells to a smooth, evenly spaced path of poses."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.types import CostGrid, FloatArray, Path

SPACING = 0.05
"""Metres between the poses of a path, to within half a spacing over its whole length."""

_WINDOW = 5.0  # m; the longest shortcut looked for
_STRIDE = 4  # cells between the places where shortcuts may begin and end
_ROUNDING = 0.3  # m; a corner is rounded about this far to both sides
_SMOOTHNESS = 0.3  # of a point's way to its neighbours' middle per iteration: stable below 0.5
_ITERATIONS = 80
_EASY = 160  # corners may be cut through cells up to this cost (0.11 m beyond inscribed)


class Smoother:
    """Straightens where that costs nothing, rounds corners, and checks the result.

    Args:
        traverse: (256,) int64, cost of a straight step by cell cost, 0 for no way.
    """

    def __init__(self, traverse: NDArray[np.int64]) -> None:
        from stack.planning import kernels

        self._kernels: Any = kernels
        self._traverse = traverse

    def smooth(self, costs: CostGrid, points: FloatArray, heading: float) -> Path:
        """A smooth path with the ends of `points`, or as near to it as the costs allow.

        Tried in turn: rounded, straightened, unchanged. The first that meets no more cells
        without a way than the unchanged one (none, unless the start is in a bad place) is taken.

        Args:
            costs: map frame.
            points: (n, 2) metres, map frame: start, middles of the cells, end.
            heading: of the last pose, radians.

        Returns:
            Poses SPACING apart; their headings follow the path.
        """
        kernels, traverse, cells = self._kernels, self._traverse, costs.cells
        scale, origin = costs.resolution, np.array(costs.origin)
        raw = (points - origin) / scale
        window = max(1, round(_WINDOW / scale / _STRIDE))
        kept = kernels.straighten(cells, traverse, raw, _STRIDE, window)
        straight = resampled(raw[kept], SPACING / scale)
        # a kink fades out over sqrt(smoothness / data) points: that many make the rounding
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
    """The path along points (n, 2) in metres as they are, evenly spaced."""
    return with_headings(resampled(points, SPACING), heading)


def resampled(points: FloatArray, spacing: float) -> FloatArray:
    """Points (m, 2) along the line through (n, 2), ends included, evenly spaced by about this."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    count = max(1, round(float(along[-1]) / spacing))
    at = np.linspace(0.0, along[-1], count + 1)
    even = np.column_stack([np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])])
    even[0], even[-1] = points[0], points[-1]
    return even


def with_headings(points: FloatArray, heading: float) -> Path:
    """Poses whose headings point from the neighbour before to the one after; the last is given."""
    ahead = np.vstack([points[1:], points[-1:]])
    behind = np.vstack([points[:1], points[:-1]])
    x, y = (ahead - behind).T
    poses = np.column_stack([points, np.arctan2(y, x)])
    poses[-1, 2] = heading
    return Path(poses)
