"""A polyline with its length: places on it by metres from its beginning."""

from __future__ import annotations

import numpy as np

from stack.types import FloatArray


class Line:
    """A polyline that is measured along.

    Attributes:
        points: (n, 2) metres, map frame, n >= 2, no two neighbours alike.
        along: (n,) metres from the first point to each.
    """

    def __init__(self, points: FloatArray) -> None:
        self.points = points
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        self.along = np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Metres from end to end."""
        return float(self.along[-1])

    def at(self, lengths: FloatArray) -> FloatArray:
        """(k, 2) the places at (k,) metres from the beginning; the ends beyond them."""
        return np.column_stack([np.interp(lengths, self.along, axis) for axis in self.points.T])

    def between(self, begin: float, end: float) -> FloatArray:
        """(k, 2) the points of a stretch, its ends included; backward where end < begin."""
        low, high = min(begin, end), max(begin, end)
        inner = (self.along > low + 1e-9) & (self.along < high - 1e-9)
        ends = self.at(np.array([low, high]))
        points = np.vstack([ends[:1], self.points[inner], ends[1:]])
        return points if begin <= end else points[::-1]

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """The place nearest to a point: metres from the beginning, and metres away from it."""
        starts, ways = self.points[:-1], np.diff(self.points, axis=0)
        away = np.array([x, y]) - starts
        share = np.clip(np.einsum("ij,ij->i", away, ways) / np.einsum("ij,ij->i", ways, ways), 0, 1)
        distances = np.linalg.norm(away - share[:, None] * ways, axis=1)
        best = int(np.argmin(distances))
        step = self.along[best + 1] - self.along[best]
        return float(self.along[best] + share[best] * step), float(distances[best])

    def samples(self, spacing: float) -> FloatArray:
        """(k,) metres from the beginning, evenly spaced by at most this, both ends included."""
        return np.linspace(0.0, self.length, max(2, int(np.ceil(self.length / spacing)) + 1))
