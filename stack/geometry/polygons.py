"""Polygons in the plane: points inside, points along the outline, filling with points.

A polygon is an (n, 2) array of corners in order, n >= 3; the last corner joins the first. Metres,
in any one frame. Numba kernels have point tests of their own, and stack/safety keeps its own on
purpose, so that one fault cannot disable both of its checks.
"""

from __future__ import annotations

from math import ceil, hypot

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray

_FINE, _PLACES = 1e-3, 25
"""Metres to which the largest disc is found, and places on a side of each of its grids."""


def points_inside(points: FloatArray, corners: FloatArray) -> NDArray[np.bool_]:
    """Tell which points lie in a polygon, by the crossing number of a ray towards +x.

    Args:
        points: (m, 2).
        corners: (n, 2) of a simple polygon, in either direction.

    Returns:
        (m,) bool. Points on a left or lower edge count as inside, on a right or upper one as
        outside, so that adjacent polygons share no point.
    """
    inside = np.zeros(len(points), dtype=bool)
    x, y = points[:, 0], points[:, 1]
    for (x1, y1), (x2, y2) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        if y1 != y2:
            crosses = (y1 > y) != (y2 > y)
            inside ^= crosses & (x < x1 + (y - y1) * (x2 - x1) / (y2 - y1))
    return inside


def distances_to_edges(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Return (m,) distances of points (m, 2) to the nearest edge of a polygon, metres."""
    nearest = np.full(len(points), np.inf)
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        edge = end - start
        along = np.clip((points - start) @ edge / max(float(edge @ edge), 1e-18), 0.0, 1.0)
        off = points - start - along[:, None] * edge
        nearest = np.minimum(nearest, np.hypot(off[:, 0], off[:, 1]))
    return nearest


def widest_disc(corners: FloatArray) -> tuple[float, float, float]:
    """Return (x, y, radius) of the largest disc in a polygon, metres; about the origin if nearly.

    Found to about a millimetre, on grids that become finer around the best place. A robot of this
    outline gets nowhere where the disc does not.
    """

    def radii(places: FloatArray) -> FloatArray:
        away = distances_to_edges(places, corners)
        return np.where(points_inside(places, corners), away, -away)

    x, y, radius = 0.0, 0.0, float(radii(np.zeros((1, 2)))[0])
    about_origin = radius
    low, high = corners.min(axis=0), corners.max(axis=0)
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    while half.max() > _FINE:
        axes = [middle[axis] + np.linspace(-half[axis], half[axis], _PLACES) for axis in (0, 1)]
        places = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
        gaps = radii(places)
        number = int(np.argmax(gaps))
        if gaps[number] > radius:
            (x, y), radius = places[number].tolist(), float(gaps[number])
        middle, half = places[number], 0.2 * half
    return (0.0, 0.0, about_origin) if radius <= about_origin + 2.0 * _FINE else (x, y, radius)


def outline_points(corners: FloatArray, spacing: float) -> FloatArray:
    """Return points along the edges in order, corners included, at most `spacing` metres apart.

    Returns:
        (m, 2) points; the first corner stands first and is not repeated.
    """
    points = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        pieces = max(1, ceil(hypot(*(end - start)) / spacing))
        points.append(start + (end - start) * (np.arange(pieces) / pieces)[:, None])
    return np.vstack(points)


def fill_polygon(corners: FloatArray, spacing: float) -> FloatArray:
    """Return the outline's points and a square lattice inside, at most `spacing` metres apart."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, y = (np.arange(a, b, spacing) for a, b in zip(low, high, strict=True))
    lattice = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = lattice[points_inside(lattice, corners)]
    return np.ascontiguousarray(np.vstack([outline_points(corners, spacing), inside]))
