"""Level planes in point clouds: consensus of samples (RANSAC), then least squares.

M. A. Fischler and R. C. Bolles, "Random Sample Consensus", Communications of the ACM 24, 1981.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, radians

import numpy as np

from stack.streams import stream
from stack.types import FloatArray

SAMPLES = 60
"""Planes that are tried. With half of the points on the plane, one in eight is of three of them:
all miss it with a probability of (7/8)**60 = 0.03 %."""

STEEPEST = cos(radians(15.0))
"""Cosine of the angle to the vertical of the normal of a plane that is taken as level."""

NEAR = 0.006
"""Metres from a plane up to which points support it: three deviations of a depth camera."""

LEAST_POINTS, LEAST_SHARE = 30, 0.3
"""Points that a plane needs, and their share of all."""

_ROUNDS = 2
"""Least-squares fits, each to the points near the plane before."""


@dataclass(frozen=True, slots=True)
class Plane:
    """A plane: points p with `normal @ p == offset`.

    Attributes:
        normal: (3,) unit vector, upwards.
        offset: metres.
        deviation: standard deviation of the points from the plane, metres.
        count: number of points on it.
    """

    normal: FloatArray
    offset: float
    deviation: float
    count: int

    def heights(self, points: FloatArray) -> FloatArray:
        """Return (…) the distances of points (…, 3) above the plane, metres."""
        found: FloatArray = points @ self.normal - self.offset
        return found


def level_plane(points: FloatArray) -> Plane | None:
    """Return the level plane on which most of the points (n, 3) lie.

    None: too few points, or too few of them on one plane.
    """
    if len(points) < LEAST_POINTS:
        return None
    chosen = stream(0, "level_plane").integers(0, len(points), (SAMPLES, 3))
    a, b, c = (points[chosen[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    lengths = np.linalg.norm(normals, axis=1)
    normals = normals / np.maximum(lengths, 1e-12)[:, None]
    normals *= np.sign(normals[:, 2:])
    level = normals[:, 2] >= STEEPEST
    if not level.any():
        return None
    normals, a = normals[level], a[level]
    near = np.abs(points @ normals.T - np.einsum("ij,ij->i", normals, a)) <= NEAR
    members = near[:, int(np.argmax(near.sum(axis=0)))]
    for _ in range(_ROUNDS):
        plane = _least_squares(points[members])
        members = np.abs(plane.heights(points)) <= NEAR
    enough = plane.count >= max(LEAST_POINTS, LEAST_SHARE * len(points))
    return plane if enough and plane.normal[2] >= STEEPEST else None


def _least_squares(points: FloatArray) -> Plane:
    mean = points.mean(axis=0)
    off = points - mean
    _, axes = np.linalg.eigh(off.T @ off)
    normal = axes[:, 0] * np.sign(axes[2, 0])
    return Plane(normal, float(normal @ mean), float(np.std(off @ normal)), len(points))
