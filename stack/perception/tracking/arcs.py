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
    from stack.perception.tracking.kernels import fit_circle  # imports numba

    x, y, radius, noise, radius_deviation, deviation = fit_circle(
        np.ascontiguousarray(points), ITERATIONS, LEAST_NOISE
    ).tolist()
    mx, my = points.mean(axis=0).tolist()
    bulges = (x - mx) * mx + (y - my) * my > 0.0
    if not (bulges and noise <= NOT_ROUND and radius_deviation <= SURE):
        return None
    return Arc(np.array([x, y]), radius, deviation)
