"""SDF geometry to what stands in a world: boxes and cylinders that rise from the floor."""

from __future__ import annotations

from itertools import product
from math import atan2, cos, hypot, sin

import numpy as np

from stack.sim.sdf.mesh_parts import rectangle_round
from stack.sim.worlds.world import Box, Cylinder
from stack.types import FloatArray, Pose2D

UPRIGHT = 0.9998
"""Cosine of the tilt (about 1 degree) below which an axis counts as vertical."""

Solid = Box | Cylinder


def transform(position: FloatArray, angles: FloatArray) -> FloatArray:
    """(4, 4) of an SDF pose: metres, then roll, pitch and yaw about the fixed x, y and z axes."""
    (cr, cp, cy), (sr, sp, sy) = (map(f, angles.tolist()) for f in (cos, sin))
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    matrix[:3, 3] = position
    return matrix


def from_quaternion(position: FloatArray, quaternion: FloatArray) -> FloatArray:
    """(4, 4) of a position (metres) and a quaternion x, y, z, w, of any length but 0."""
    x, y, z, w = (quaternion / np.linalg.norm(quaternion)).tolist()
    matrix = np.eye(4)
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, 3] = position
    return matrix


def part(corners: FloatArray, name: str) -> tuple[Solid, float, bool]:
    """The smallest upright box round the corners (n, 3) of a convex part, as `box` says it."""
    heading, middle, size = rectangle_round(corners[:, :2])
    pose = Pose2D(float(middle[0]), float(middle[1]), heading)
    top = float(corners[:, 2].max())
    return Box(pose, (*size.tolist(), top), name=name), float(corners[:, 2].min()), True


def box(matrix: FloatArray, size: FloatArray, name: str) -> tuple[Solid, float, bool]:
    """A box as one that stands upright on the floor.

    Args:
        matrix: (4, 4) of its middle, world frame.
        size: (3,) metres.
        name: for messages.

    Returns:
        The box, the height of its lower side over the floor, and whether it is exact; a tilted box
        is replaced by the upright one round it.
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
    return (*_box_round(corners, heading, name), exact)


def cylinder(
    matrix: FloatArray, radius: float, length: float, name: str
) -> tuple[Solid, float, bool]:
    """A cylinder along its z axis, as `box` does; a lying or tilted one becomes a box."""
    axis = matrix[:3, 2]
    x, y, z = matrix[:3, 3].tolist()
    if abs(float(axis[2])) >= UPRIGHT:
        return Cylinder(x, y, radius, z + length / 2, name=name), z - length / 2, True
    reach = radius * np.sqrt(np.maximum(0.0, 1.0 - axis**2))  # of a disc about that axis
    heading = atan2(axis[1], axis[0])
    flat = hypot(axis[0], axis[1])
    tip = length / 2 * flat + radius * abs(float(axis[2]))
    rise = length / 2 * abs(float(axis[2])) + float(reach[2])
    base = transform(np.array([x, y, z]), np.array([0.0, 0.0, heading]))
    solid, bottom, _ = box(base, 2.0 * np.array([tip, radius, rise]), name)
    return solid, bottom, abs(float(axis[2])) <= 1.0 - UPRIGHT


def sphere(matrix: FloatArray, radius: float, name: str) -> tuple[Solid, float, bool]:
    """A sphere as the cylinder round it: what touches and what is seen then agree."""
    x, y, z = matrix[:3, 3].tolist()
    return Cylinder(x, y, radius, z + radius, name=name), z - radius, True


def _box_round(corners: FloatArray, heading: float, name: str) -> tuple[Box, float]:
    """The upright box with a heading round points (n, 3), and its lower side."""
    c, s = cos(heading), sin(heading)
    ahead = corners[:, 0] * c + corners[:, 1] * s
    left = corners[:, 1] * c - corners[:, 0] * s
    middle = (float(np.ptp(ahead)) / 2 + ahead.min(), float(np.ptp(left)) / 2 + left.min())
    pose = Pose2D(
        float(middle[0] * c - middle[1] * s), float(middle[0] * s + middle[1] * c), heading
    )
    size = (float(np.ptp(ahead)), float(np.ptp(left)), float(corners[:, 2].max()))
    return Box(pose, size, name=name), float(corners[:, 2].min())
