"""Height of the ground: the surface that a robot stands on at its start."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from stack.sim.sdf.shapes import Upright
from stack.sim.worlds.outlines import outline_of
from stack.types import FloatArray

AROUND = 1.5
"""Metres around the start within which the most common height is that of the ground. A pallet or
a bed covers less than half of this circle, a floor more."""

HIGHEST = 0.5
"""Metres above the origin; what is higher is furniture, a wall or the floor above."""

RINGS = ((0.0, 1), (0.25, 6), (0.5, 12), (0.75, 18), (1.0, 24))
"""Parts of the radius, and points on each circle: equal areas."""

SAME = 0.01
"""Metres by which points of one ground may differ in height."""


def ground_height(
    start: tuple[float, float],
    planes: Iterable[float],
    solids: Iterable[Upright],
    surfaces: Iterable[FloatArray],
) -> float:
    """Return the height of the ground around a start, metres; where nothing lies it is 0.

    Args:
        start: (x, y) metres.
        planes: heights of horizontal planes.
        solids: upright solids.
        surfaces: triangles (n, 3, 3) of meshes, world frame.
    """
    points = _around(start)
    heights = np.full(len(points), max((z for z in planes if z <= HIGHEST), default=-np.inf))
    for solid in solids:
        if solid.top <= HIGHEST:
            within = outline_of(solid.solid).distance_to(points) < 0.0
            heights[within] = np.maximum(heights[within], solid.top)
    for triangles in surfaces:
        heights = np.maximum(heights, _surface_below(points, triangles))
    found = np.sort(np.where(np.isfinite(heights), heights, 0.0))
    # The widest step of the sorted heights that spans at most SAME; the lowest of equal ones.
    counts = np.searchsorted(found, found + SAME, side="right") - np.arange(len(found))
    first = int(np.argmax(counts))
    return float(found[first + int(counts[first]) - 1])


def _around(start: tuple[float, float]) -> FloatArray:
    """Return points (n, 2) that are spread evenly around a start."""
    points = [
        (radius * AROUND * np.cos(angle), radius * AROUND * np.sin(angle))
        for radius, count in RINGS
        for angle in 2.0 * np.pi * (np.arange(count) + 0.5) / count
    ]
    return np.array(points) + start


def _surface_below(points: FloatArray, triangles: FloatArray) -> FloatArray:
    """Return the height (n,) of the highest surface up to HIGHEST at points (n, 2), or -inf."""
    heights = np.full(len(points), -np.inf)
    least, greatest = triangles.min(axis=1), triangles.max(axis=1)
    near = (greatest[:, :2] >= points.min(axis=0)) & (least[:, :2] <= points.max(axis=0))
    triangles = triangles[near.all(axis=1) & (least[:, 2] <= HIGHEST)]
    a, ab, ac = (
        triangles[:, 0],
        triangles[:, 1] - triangles[:, 0],
        triangles[:, 2] - triangles[:, 0],
    )
    area = ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0]
    flat = np.abs(area) > 1e-12
    a, ab, ac, area = a[flat], ab[flat], ac[flat], area[flat]
    for n, (x, y) in enumerate(points.tolist()):
        dx, dy = x - a[:, 0], y - a[:, 1]
        v = (dx * ac[:, 1] - dy * ac[:, 0]) / area
        w = (ab[:, 0] * dy - ab[:, 1] * dx) / area
        z = a[:, 2] + v * ab[:, 2] + w * ac[:, 2]
        at = z[(v >= 0.0) & (w >= 0.0) & (v + w <= 1.0) & (z <= HIGHEST)]
        heights[n] = at.max(initial=-np.inf)
    return heights
