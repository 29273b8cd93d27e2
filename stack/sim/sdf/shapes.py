"""Convert SDF geometry to boxes and cylinders that stand on the floor."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from math import atan2, cos, hypot, sin
from typing import NamedTuple

import numpy as np

from stack.geometry.rotations import from_angles
from stack.sim.worlds.world import Box, Cylinder
from stack.types import FloatArray, Pose2D

UPRIGHT = 0.9998
"""Cosine of the largest tilt (about 1 degree) at which an axis counts as vertical."""

Solid = Box | Cylinder


class Upright(NamedTuple):
    """A solid that stands on the floor.

    Attributes:
        solid: extended down to height 0.
        bottom: height of its underside, metres.
        exact: whether it has the shape of the file; a tilted box is replaced by the upright box
            around it.
    """

    solid: Solid
    bottom: float
    exact: bool

    @property
    def top(self) -> float:
        """Height of its top, metres."""
        return self.solid.size[2] if isinstance(self.solid, Box) else self.solid.height

    def above(self, ground: float) -> Upright:
        """Return it with heights that count from the ground, metres."""
        height = self.top - ground
        if isinstance(self.solid, Box):
            solid: Solid = replace(self.solid, size=(*self.solid.size[:2], height))
        else:
            solid = replace(self.solid, height=height)
        return Upright(solid, self.bottom - ground, self.exact)


def box(matrix: FloatArray, size: FloatArray, name: str) -> Upright:
    """Convert a box to an upright one that stands on the floor.

    Args:
        matrix: (4, 4) pose of its centre, world frame.
        size: (3,) metres.
        name: for messages.
    """
    rotation = matrix[:3, :3]
    vertical = int(np.argmax(np.abs(rotation[2])))
    exact = abs(float(rotation[2, vertical])) >= UPRIGHT
    along = (vertical + 1) % 3
    if not exact:
        along = int(np.argmax(np.hypot(rotation[0], rotation[1]) * size))
    heading = atan2(rotation[1, along], rotation[0, along])
    signs = np.array(list(product((-0.5, 0.5), repeat=3)))
    corners = (signs * size) @ rotation.T + matrix[:3, 3]
    return Upright(*_box_around(corners, heading, name), exact)


def cylinder(matrix: FloatArray, radius: float, length: float, name: str) -> Upright:
    """Convert a cylinder along its z axis; a horizontal or tilted one becomes a box."""
    axis = matrix[:3, 2]
    x, y, z = matrix[:3, 3].tolist()
    if abs(float(axis[2])) >= UPRIGHT:
        solid = Cylinder(x, y, radius, z + length / 2, name=name)
        return Upright(solid, z - length / 2, True)
    reach = radius * np.sqrt(np.maximum(0.0, 1.0 - axis**2))  # half extents of an end disc
    heading = atan2(axis[1], axis[0])
    flat = hypot(axis[0], axis[1])
    tip = length / 2 * flat + radius * abs(float(axis[2]))
    rise = length / 2 * abs(float(axis[2])) + float(reach[2])
    base = from_angles((x, y, z), (0.0, 0.0, heading))
    around = box(base, 2.0 * np.array([tip, radius, rise]), name)
    return around._replace(exact=abs(float(axis[2])) <= 1.0 - UPRIGHT)


def sphere(matrix: FloatArray, radius: float, name: str) -> Upright:
    """Convert a sphere to the cylinder around it, so that contacts and scans agree."""
    x, y, z = matrix[:3, 3].tolist()
    return Upright(Cylinder(x, y, radius, z + radius, name=name), z - radius, True)


def _box_around(corners: FloatArray, heading: float, name: str) -> tuple[Box, float]:
    """The upright box with this heading around points (n, 3), and the height of its underside."""
    c, s = cos(heading), sin(heading)
    ahead = corners[:, 0] * c + corners[:, 1] * s
    left = corners[:, 1] * c - corners[:, 0] * s
    middle = (float(np.ptp(ahead)) / 2 + ahead.min(), float(np.ptp(left)) / 2 + left.min())
    pose = Pose2D(
        float(middle[0] * c - middle[1] * s), float(middle[0] * s + middle[1] * c), heading
    )
    size = (float(np.ptp(ahead)), float(np.ptp(left)), float(corners[:, 2].max()))
    return Box(pose, size, name=name), float(corners[:, 2].min())
