"""Rectangle that separates the points inside from those outside, below the distance of pixels.

A minimum-area rectangle of the points inside hangs on the few outermost of them. Here each point of
a regular pattern, inside or outside, tells something: the share of a pixel that a rectangle covers
falls from 1 to 0 across its edge as a logistic function, and its least-squares fit to the labels is
found by Levenberg-Marquardt from the minimum-area rectangle.

Labels may be smeared in a direction, as those of a top face are by the upper parts of the sides:
what is labelled is then the rectangle swept along a vector, a hexagon. Points of the sides, seen
from above, lie on the outline of the rectangle.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import radians, sqrt

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray

SOFTNESS = 0.3
"""Scale of the logistic function, in distances of neighbouring points."""

LEAST_VARIANCE = 0.02
"""Smallest variance of a residual: the pattern of pixels is regular, so a perfect fit of the labels
does not mean perfect edges."""

OUTLIER = 3.0
"""Standard deviations to which the distance of a point from the outline is limited."""

_STEPS, _DAMPING, _ENOUGH = 20, 1e-3, 1e-3
"""Steps at most, damping of the first one, and share of the squares that a step must gain."""

_DIFFERENCE = 1e-6
"""Metres and radians."""


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle in a plane.

    Attributes:
        centre: (2,) metres.
        angle: of its first side, radians.
        sides: (2,) lengths, metres.
        covariance: (3, 3) of centre and angle.
    """

    centre: FloatArray
    angle: float
    sides: FloatArray
    covariance: FloatArray

    def contains(self, points: FloatArray, margin: float = 0.0) -> NDArray[np.bool_]:
        """Return (n,) which points (n, 2) are inside, or outside by a margin in metres at most."""
        local = (points - self.centre) @ _turn(self.angle)
        return np.asarray((np.abs(local) <= self.sides / 2.0 + margin).all(axis=1), np.bool_)


@dataclass(frozen=True, eq=False, slots=True)
class EdgeEvidence:
    """What is seen of a rectangle.

    Attributes:
        points: (n, 2) of a pattern that is regular and covers the surroundings, metres.
        inside: (n,) labels, at least three of them true.
        spacing: distance of neighbouring points, metres.
        sweep: (2,) vector by which the labels are smeared, metres; zero without one.
        outline: (m, 2) points on the outline, or none.
        noise: standard deviation of these, metres.
    """

    points: FloatArray
    inside: NDArray[np.bool_]
    spacing: float
    sweep: FloatArray
    outline: FloatArray
    noise: float

    def residuals(self, values: FloatArray) -> FloatArray:
        """Return (n + m,) covered shares minus labels, and distances from the outline.

        Args:
            values: (5,) centre, angle and half sides.
        """
        turn, half = _turn(values[2]), values[3:]
        off = self.points - values[:2] - self.sweep / 2.0
        inside = half + np.abs(self.sweep @ turn) / 2.0 - np.abs(off @ turn)
        margins = [inside[:, 0], inside[:, 1]]
        length = float(np.linalg.norm(self.sweep))
        if length > 0.0:
            across = np.array([-self.sweep[1], self.sweep[0]]) / length
            margins.append(half @ np.abs(across @ turn) - np.abs(off @ across))
        away = np.clip(np.array(margins) / (SOFTNESS * self.spacing), -40.0, 40.0)
        covered = np.prod(1.0 / (1.0 + np.exp(-away)), axis=0) - self.inside
        beyond = np.abs((self.outline - values[:2]) @ turn) - half
        outside = np.clip(beyond.max(axis=1) / self.noise, -OUTLIER, OUTLIER)
        found: FloatArray = np.concatenate([covered, sqrt(LEAST_VARIANCE) * outside])
        return found

    def jacobian(self, values: FloatArray) -> FloatArray:
        """Return (n + m, 5) the derivatives of the residuals by differences."""
        here, steps = self.residuals(values), _DIFFERENCE * np.eye(5)
        columns = [self.residuals(values + step) - here for step in steps]
        return np.column_stack(columns) / _DIFFERENCE

    def start(self) -> FloatArray:
        """Return (5,) the minimum-area rectangle of the points inside."""
        inside = self.points[self.inside].astype(np.float32)
        (u, v), sides, degrees = cv2.minAreaRect(inside)
        # The outermost points are inside the edges, and the sweep has moved the middle.
        u, v = np.array([u, v]) - self.sweep / 2.0
        return np.array([u, v, radians(degrees), *(0.5 * (side + self.spacing) for side in sides)])


def fit_rectangle(seen: EdgeEvidence) -> Rectangle | None:
    """Return the rectangle that explains what is seen; None if that does not determine it."""
    values = seen.start()
    damping, off, jacobian = _DAMPING, seen.residuals(values), seen.jacobian(values)
    for _ in range(_STEPS):
        normal = jacobian.T @ jacobian
        lift = damping * np.diag(normal.diagonal() + 1e-12)
        trial = values - np.linalg.solve(normal + lift, jacobian.T @ off)
        trial[3:] = np.maximum(trial[3:], 0.25 * seen.spacing)
        new = seen.residuals(trial)
        if new @ new >= off @ off:
            damping *= 6.0
            continue
        gain = 1.0 - float(new @ new) / float(off @ off)
        values, off, damping = trial, new, damping / 4.0
        jacobian = seen.jacobian(values)
        if gain < _ENOUGH:
            break
    normal = jacobian.T @ jacobian
    if not np.linalg.cond(normal) < 1e12:  # also NaN
        return None
    edge = np.abs(jacobian).sum(axis=1) > 0.0
    variance = max(LEAST_VARIANCE, float(off @ off) / max(1, int(edge.sum()) - 5))
    covariance = np.asarray(variance * np.linalg.inv(normal)[:3, :3], np.float64)
    return Rectangle(values[:2], float(values[2]), 2.0 * values[3:], covariance)


def _turn(angle: float) -> FloatArray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])
