"""Poses in the plane as rows x, y, heading, and the matrices that carry their covariances."""

from __future__ import annotations

from math import cos, sin

import numpy as np

from stack.types import FloatArray, Pose2D, wrap_angle


def as_row(pose: Pose2D) -> FloatArray:
    """Return a pose as (3,) x, y, heading."""
    return np.array([pose.x, pose.y, pose.heading])


def as_pose(row: FloatArray) -> Pose2D:
    """Return the pose of a row x, y, heading; the heading is wrapped."""
    return Pose2D(0.0, 0.0).compose(Pose2D(float(row[0]), float(row[1]), float(row[2])))


def are_near(one: Pose2D, other: Pose2D, distance: float, angle: float) -> bool:
    """Whether two poses are nearer than both a distance, metres, and an angle, radians."""
    turned = abs(wrap_angle(one.heading - other.heading))
    return one.distance_to(other) < distance and turned < angle


def rotation(heading: float) -> FloatArray:
    """Return the matrix R (3, 3) that turns x, y, heading: R C Rᵀ turns a covariance C."""
    c, s = cos(heading), sin(heading)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def lever(heading: float, by: Pose2D) -> FloatArray:
    """Return the derivative (3, 3) of a pose after a displacement with respect to that before it.

    An error of the heading turns what follows.

    Args:
        heading: before the displacement.
        by: displacement in the frame of the pose before it.
    """
    c, s = cos(heading), sin(heading)
    x, y = c * by.x - s * by.y, s * by.x + c * by.y
    return np.array([[1.0, 0.0, -y], [0.0, 1.0, x], [0.0, 0.0, 1.0]])
