"""Polyline parametrised by arc length."""

from __future__ import annotations

import numpy as np

from stack.types import FloatArray


class Line:
    """Polyline parametrised by arc length.

    Attributes:
        points: (n, 2) metres, map frame, n >= 2; successive points differ.
        along: (n,) arc length of each point, metres.
    """

    def __init__(self, points: FloatArray) -> None:
        self.points = points
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        self.along = np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length(self) -> float:
        """Length in metres."""
        return float(self.along[-1])

    def at(self, lengths: FloatArray) -> FloatArray:
        """Return the (k, 2) points at (k,) arc lengths, clamped to the ends."""
        return np.column_stack([np.interp(lengths, self.along, axis) for axis in self.points.T])

    def between(self, begin: float, end: float) -> FloatArray:
        """Return the (k, 2) points from arc length begin to end, both included."""
        low, high = min(begin, end), max(begin, end)
        inner = (self.along > low + 1e-9) & (self.along < high - 1e-9)
        ends = self.at(np.array([low, high]))
        points = np.vstack([ends[:1], self.points[inner], ends[1:]])
        return points if begin <= end else points[::-1]

    def nearest(self, x: float, y: float) -> tuple[float, float]:
        """Return the arc length of the point nearest to (x, y), and its distance; metres."""
        starts, steps = self.points[:-1], np.diff(self.points, axis=0)
        away = np.array([x, y]) - starts
        squares = np.einsum("ij,ij->i", steps, steps)
        share = np.clip(np.einsum("ij,ij->i", away, steps) / squares, 0, 1)
        distances = np.linalg.norm(away - share[:, None] * steps, axis=1)
        best = int(np.argmin(distances))
        step = self.along[best + 1] - self.along[best]
        return float(self.along[best] + share[best] * step), float(distances[best])

    def samples(self, spacing: float) -> FloatArray:
        """Return (k,) arc lengths, at most `spacing` metres apart, both ends included."""
        return np.linspace(0.0, self.length, max(2, int(np.ceil(self.length / spacing)) + 1))
