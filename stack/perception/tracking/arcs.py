"""Arcs of circles in a cluster of returns.

Two bodies that touch, or stand close together, give one cluster. The visible side of one convex
body is convex; where the returns lie behind the convex hull of a cluster, one body ends and the
next one begins. The centre and the radius of a body that is partly hidden follow from the curvature
of its visible arc, if the arc is long enough: geometric fit by Gauss-Newton from Kåsa's algebraic
one (I. Kåsa, "A circle fitting procedure and its error analysis", IEEE Trans. Instrumentation and
Measurement 25(1), 1976).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stack.types import FloatArray

DEPTH = 0.08
"""Metres behind the convex hull of a cluster that separate two bodies."""

UNIT, FAR = 0.001, 100.0
"""Metres: OpenCV finds depths of whole numbers only; a cluster's shadow ends behind all returns."""

LEAST_RETURNS = 4
"""Of a cluster that may be two bodies."""

LEAST_POINTS = 8
ITERATIONS = 4

NOT_ROUND = 0.03
"""Largest root mean square of the distances of an arc's returns from the circle, metres."""

LEAST_NOISE = 0.01
"""Metres: noise of a return if the fit leaves less."""

SURE = 0.1
"""Largest standard deviation of the radius for an arc that determines its circle, metres."""


@dataclass(frozen=True, slots=True)
class Arc:
    """Circle through returns.

    Attributes:
        centre: (2,) metres.
        radius: metres.
        deviation: standard deviation of the centre in its least certain direction, metres.
    """

    centre: FloatArray
    radius: float
    deviation: float


def convex_parts(points: FloatArray) -> list[tuple[int, int]]:
    """Return the parts of a cluster that are convex towards the sensor, (first, last + 1) each.

    A cluster that surrounds the sensor is one part.

    Args:
        points: (n, 2) returns in the order of their beams, sensor at the origin, metres.
    """
    across = points @ points.mean(axis=0)
    parts, left = [], [(0, len(points))]
    if across.min() <= 0.0:
        return left
    while left:
        first, end = left.pop()
        corner = _deepest(points[first:end])
        if corner is None:
            parts.append((first, end))
        else:
            left += [(first + corner, end), (first, first + corner)]
    return parts


def _deepest(points: FloatArray) -> int | None:
    """Index of the return deepest behind the hull, the first of the second body; None: convex."""
    import cv2

    if len(points) < LEAST_RETURNS:
        return None
    ends = points[[-1, 0]]
    shadow = FAR / np.hypot(ends[:, 0], ends[:, 1])[:, None] * ends
    contour = np.rint(np.vstack((points, shadow)) / UNIT).astype(np.int32)[:, None]
    hull = np.sort(cv2.convexHull(contour, returnPoints=False).ravel())[:, None]
    found = cv2.convexityDefects(contour, hull)
    if found is None:
        return None
    _, _, at, depth = found.reshape(-1, 4).T
    best = int(depth.argmax())
    corner = int(at[best])
    is_deep = depth[best] * UNIT / 256.0 > DEPTH
    return corner if is_deep and 0 < corner < len(points) else None


def fit_arc(points: FloatArray) -> Arc | None:
    """Fit a circle to returns on its visible side; None if they do not determine one.

    Args:
        points: (n, 2), sensor at the origin, metres.
    """
    if len(points) < LEAST_POINTS:
        return None
    middle = points.mean(axis=0)
    local = points - middle
    try:
        circle = _algebraic(local)
        for _ in range(ITERATIONS):
            slopes, errors = _slopes(local, circle)
            circle = circle - np.linalg.solve(slopes.T @ slopes, slopes.T @ errors)
        slopes, errors = _slopes(local, circle)
        spread = np.linalg.inv(slopes.T @ slopes)
    except np.linalg.LinAlgError:  # returns on a line
        return None
    noise = float(np.sqrt((errors @ errors) / (len(points) - 3)))
    spread *= max(2.0 * noise, LEAST_NOISE) ** 2
    bulges = circle[:2] @ middle > 0.0
    if not bulges or not noise <= NOT_ROUND or spread[2, 2] > SURE**2:
        return None
    deviation = float(np.sqrt(np.linalg.eigvalsh(spread[:2, :2])[-1]))
    return Arc(middle + circle[:2], float(circle[2]), deviation)


def _algebraic(points: FloatArray) -> FloatArray:
    """Kåsa's fit: the circle (3,) x, y, radius through points (n, 2) around their mean."""
    square = (points * points).sum(axis=1)
    x, y = np.linalg.solve(points.T @ points, 0.5 * points.T @ square)
    return np.array([x, y, np.sqrt(square.mean() + x * x + y * y)])


def _slopes(points: FloatArray, circle: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the derivatives (n, 3) of the distances (n,) from the circle, and those."""
    off = points - circle[:2]
    away = np.maximum(np.hypot(off[:, 0], off[:, 1]), 1e-6)
    slopes = np.full((len(off), 3), -1.0)
    slopes[:, :2] = -off / away[:, None]
    return slopes, away - circle[2]
