"""Mirrors of a world: their faces, and the geometry of reflection at upright planes."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from stack.sim.physics.meshes import box_outline, wall_slabs
from stack.sim.worlds.world import World
from stack.types import FloatArray, Pose2D

CLEAR_OF_MIRROR = 1e-6
"""Metres from a mirror at which a reflected ray begins, so that it does not meet the same face."""

LEAST_HEIGHT = 1e-3
"""Metres in front of a mirror that it does not show, so that it does not show itself."""


@dataclass(frozen=True, slots=True)
class MirrorFace:
    """An upright rectangle that reflects what is on its right, seen from `start` towards `end`.

    Attributes:
        start: (x, y) of one end, metres.
        end: (x, y) of the other.
        bottom: height of its lower edge, metres.
        top: height of its upper edge, metres.
    """

    start: tuple[float, float]
    end: tuple[float, float]
    bottom: float
    top: float

    @property
    def normal(self) -> FloatArray:
        """Direction (3,) out of the face, of length 1."""
        along = np.subtract(self.end, self.start) / self.length
        return np.array([along[1], -along[0], 0.0])

    @property
    def length(self) -> float:
        """Length, metres."""
        return float(np.hypot(*np.subtract(self.end, self.start)))

    @property
    def offset(self) -> float:
        """Distance of its plane from the origin along the normal, metres."""
        return float(self.normal[:2] @ self.start)

    def is_in_front(self, point: FloatArray) -> bool:
        """Return whether a point (2,) or (3,) is on the side that the face reflects."""
        return float(self.normal[: point.size] @ point) > self.offset

    def shows(self, other: MirrorFace) -> bool:
        """Return whether a part of another face is in front of this one."""
        ends = np.array([other.start, other.end])
        return bool((ends @ self.normal[:2] > self.offset + LEAST_HEIGHT).any())

    def reflection(self) -> FloatArray:
        """Return (4, 4) that maps points to their mirror images: I - 2 n n^T, about the plane."""
        matrix, normal = np.eye(4), self.normal
        matrix[:3, :3] -= 2.0 * np.outer(normal, normal)
        matrix[:3, 3] = 2.0 * self.offset * normal
        return matrix


def mirror_faces(world: World) -> tuple[MirrorFace, ...]:
    """Return the upright faces of the mirrors of a world."""
    return tuple(_faces(world))


def _faces(world: World) -> Iterator[MirrorFace]:
    for wall in world.walls:
        for pose, length in wall_slabs(wall) if wall.mirror else ():
            yield from _sides(pose, (length, wall.thickness, wall.height), 0.0)
    for box in world.boxes:
        if box.mirror:
            yield from _sides(box.pose, box.size, box.elevation)


def _sides(pose: Pose2D, size: tuple[float, float, float], bottom: float) -> Iterator[MirrorFace]:
    corners = [(x, y) for x, y in box_outline(pose, size[0], size[1]).tolist()]  # anticlockwise
    for start, end in zip(corners, corners[1:] + corners[:1], strict=True):
        yield MirrorFace(start, end, bottom, bottom + size[2])


def mirrors_at(points: FloatArray, mirrors: FloatArray) -> NDArray[np.intp]:
    """Return the index (n,) of the mirror on which each point lies; -1 for none.

    Args:
        points: (n, 2) metres; their distance from a mirror counts as none below 1 nm.
        mirrors: (k, 4) x, y of one end and x, y of the other, metres.
    """
    along = mirrors[:, 2:] - mirrors[:, :2]
    lengths = np.hypot(along[:, 0], along[:, 1])
    along = along / lengths[:, None]
    apart = points[:, None, :] - mirrors[None, :, :2]
    ahead = (apart * along).sum(axis=2)
    aside = apart[:, :, 0] * along[:, 1] - apart[:, :, 1] * along[:, 0]
    on = (np.abs(aside) < 1e-9) & (ahead > -1e-9) & (ahead < lengths + 1e-9)
    return np.where(on.any(axis=1), on.argmax(axis=1), -1)


def reflected(units: FloatArray, mirrors: FloatArray) -> FloatArray:
    """Return the directions (n, 2) of rays after a mirror: u' = 2 (u . t) t - u.

    Args:
        units: (n, 2) directions before it, of length 1.
        mirrors: (n, 4) ends of the mirror of each, metres; t is the direction along it.
    """
    along = mirrors[:, 2:] - mirrors[:, :2]
    along = along / np.hypot(along[:, 0], along[:, 1])[:, None]
    turned: FloatArray = 2.0 * (units * along).sum(axis=1, keepdims=True) * along - units
    return turned


def in_front(corners: FloatArray, face: MirrorFace) -> FloatArray:
    """Return the parts (m, 3, 3) of triangles (n, 3, 3) that a face reflects.

    What is less than LEAST_HEIGHT in front of its plane is left out. Triangles that cross that
    limit are cut (I. Sutherland, G. Hodgman 1974).
    """
    heights = corners @ face.normal - face.offset - LEAST_HEIGHT
    whole = (heights >= 0.0).all(axis=1)
    crossing = (heights > 0.0).any(axis=1) & ~whole
    parts = [corners[whole]]
    for triangle, height in zip(corners[crossing], heights[crossing], strict=True):
        outline = list(_cut(triangle, height))
        parts += [np.array([[outline[0], b, c]]) for b, c in pairwise(outline[1:])]
    return np.concatenate(parts)


def _cut(triangle: FloatArray, heights: FloatArray) -> Iterator[FloatArray]:
    """Yield the corners (3,) of the part of a triangle where the heights (3,) are positive."""
    for n in range(3):
        begin, end = triangle[n], triangle[(n + 1) % 3]
        low, high = heights[n], heights[(n + 1) % 3]
        if low >= 0.0:
            yield begin
        if (low >= 0.0) != (high >= 0.0):
            yield begin + low / (low - high) * (end - begin)
