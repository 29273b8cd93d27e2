"""Outlines of a world's fixed objects on the floor: rectangles and discs."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import atan2, hypot

import numpy as np

from stack.sim.worlds.world import Box, Cylinder, Wall, World
from stack.types import FloatArray, Pose2D


@dataclass(frozen=True, slots=True)
class Rectangle:
    """A rectangle on the floor: centre pose, half length (along x) and half width.

    Metres in the world frame; `name` is for messages.
    """

    pose: Pose2D
    half_length: float
    half_width: float
    name: str = ""

    def distance_to(self, points: FloatArray) -> FloatArray:
        """Return the distance of points (n, 2) to the rim: (n,) metres, negative inside."""
        local = np.abs(self.pose.inverse().transform(points))
        beyond = local - (self.half_length, self.half_width)
        outside = np.linalg.norm(np.maximum(beyond, 0.0), axis=1)
        distance: FloatArray = outside + np.minimum(beyond.max(axis=1), 0.0)
        return distance

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box x_min, y_min, x_max, y_max, metres."""
        signs = np.array([[1, 1], [1, -1], [-1, -1], [-1, 1]], dtype=float)
        corners = self.pose.transform(signs * (self.half_length, self.half_width))
        (x_min, y_min), (x_max, y_max) = corners.min(axis=0), corners.max(axis=0)
        return float(x_min), float(y_min), float(x_max), float(y_max)


@dataclass(frozen=True, slots=True)
class Disc:
    """A disc on the floor, metres in the world frame; `name` is for messages."""

    x: float
    y: float
    radius: float
    name: str = ""

    def distance_to(self, points: FloatArray) -> FloatArray:
        """Return the distance of points (n, 2) to the rim: (n,) metres, negative inside."""
        distance: FloatArray = np.linalg.norm(points - (self.x, self.y), axis=1) - self.radius
        return distance

    @property
    def extent(self) -> tuple[float, float, float, float]:
        """Bounding box x_min, y_min, x_max, y_max, metres."""
        r = self.radius
        return self.x - r, self.y - r, self.x + r, self.y + r


Outline = Rectangle | Disc


def outlines(world: World, *, mapped_only: bool = False) -> list[Outline]:
    """Return the outlines of walls, boxes and cylinders, in that order, without doors and people.

    Args:
        world: world to outline.
        mapped_only: only objects that are on the map.
    """
    walls = (slab for wall in world.walls if wall.on_map or not mapped_only
             for slab in wall_slabs(wall))  # fmt: skip
    solids: tuple[Box | Cylinder, ...] = (*world.boxes, *world.cylinders)
    return [*walls, *(outline_of(solid) for solid in solids if solid.on_map or not mapped_only)]


def outline_of(solid: Box | Cylinder) -> Outline:
    """Return the outline of a box or cylinder."""
    if isinstance(solid, Box):
        half_length, half_width = solid.size[0] / 2, solid.size[1] / 2
        return Rectangle(solid.pose, half_length, half_width, solid.name or "a box")
    return Disc(solid.x, solid.y, solid.radius, solid.name or "a cylinder")


def wall_slabs(wall: Wall) -> list[Rectangle]:
    """Return one rectangle per wall segment, half a thickness longer at each inner joint.

    The overlap fills a right-angled corner exactly; the free ends of a wall end where its points
    do. A wall whose last point is its first has no free ends.
    """
    slabs = []
    points = wall.points
    closed = len(points) > 2 and bool(np.all(points[0] == points[-1]))
    half = wall.thickness / 2
    last = len(points) - 2
    for number, (start, end) in enumerate(pairwise(points)):
        length = hypot(*(end - start))
        before = half if closed or number > 0 else 0.0
        after = half if closed or number < last else 0.0
        heading = atan2(end[1] - start[1], end[0] - start[0])
        middle = Pose2D(float(start[0]), float(start[1]), heading).compose(
            Pose2D((length + after - before) / 2, 0.0)
        )
        slabs.append(Rectangle(middle, (length + before + after) / 2, half, "a wall"))
    return slabs
