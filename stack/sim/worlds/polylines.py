"""Polylines with rounded corners."""

from __future__ import annotations

from math import pi

import numpy as np

from stack.types import FloatArray

ARC_STEP = pi / 36.0
"""Radians from point to point of an arc; its chords lie 0.1 % of the radius inside."""


def rounded(points: FloatArray, radius: float, *, closed: bool = False) -> FloatArray:
    """Return a polyline whose corners are arcs that touch both sides.

    An arc takes at most half of each side, so that the radius is smaller at short sides.

    Args:
        points: (n, 2) metres, n >= 2; consecutive points differ.
        radius: of the arcs, metres; 0: sharp corners.
        closed: join the last point to the first.

    Returns:
        (m, 2) metres; the first point again at the end if it is closed.
    """
    if closed:
        return _rounded_loop(points, radius)
    inner = [
        _arc(points[n - 1], points[n], points[n + 1], radius) for n in range(1, len(points) - 1)
    ]
    return _distinct(np.concatenate([points[:1], *inner, points[-1:]]))


def _rounded_loop(points: FloatArray, radius: float) -> FloatArray:
    if np.allclose(points[0], points[-1]):
        points = points[:-1]
    count = len(points)
    arcs = [_arc(points[n - 1], points[n], points[(n + 1) % count], radius) for n in range(count)]
    loop = np.concatenate(arcs)
    return _distinct(np.concatenate([loop, loop[:1]]))


def _distinct(points: FloatArray) -> FloatArray:
    """Return the points without those that repeat the one before; full arcs meet in a point."""
    apart = np.linalg.norm(np.diff(points, axis=0), axis=1) > 1e-9
    distinct: FloatArray = points[np.concatenate([[True], apart])]
    return distinct


def _arc(before: FloatArray, corner: FloatArray, after: FloatArray, radius: float) -> FloatArray:
    """Return the points (m, 2) of the arc at a corner; the corner itself if there is none."""
    inward, outward = before - corner, after - corner
    lengths = np.linalg.norm(inward), np.linalg.norm(outward)
    inward, outward = inward / lengths[0], outward / lengths[1]
    turn = pi - float(np.arccos(np.clip(inward @ outward, -1.0, 1.0)))
    if radius <= 0.0 or turn < 1e-6 or turn > pi - 1e-6:
        return corner[None]
    tangent = min(radius * np.tan(turn / 2.0), *(0.5 * length for length in lengths))
    radius = tangent / np.tan(turn / 2.0)
    towards = inward + outward
    centre = corner + towards / np.linalg.norm(towards) * radius / np.cos(turn / 2.0)
    start = corner + tangent * inward - centre
    side = np.sign(inward[1] * outward[0] - inward[0] * outward[1])
    angles = side * np.linspace(0.0, turn, max(2, round(turn / ARC_STEP) + 1))
    cos, sin = np.cos(angles), np.sin(angles)
    arc: FloatArray = centre + np.column_stack(
        [cos * start[0] - sin * start[1], sin * start[0] + cos * start[1]]
    )
    return arc
