"""Error of odometry between two scans, apart from kernels."""

from __future__ import annotations

from math import hypot

from stack.types import Pose2D

DISTANCE_ERROR, ANGLE_ERROR = 0.15, 0.15
"""Standard deviations per metre driven and per radian turned: wheels that slip. Matches correct
smaller errors, and larger ones are searched."""

TURN_OF_METRE = 0.3
"""Radians turned that a metre driven counts as, for the heading."""


def odometry_error(moved: Pose2D) -> tuple[float, float]:
    """Return the standard deviations of position (m) and heading (rad) of a motion by odometry."""
    distance = hypot(moved.x, moved.y)
    turned = abs(moved.heading) + TURN_OF_METRE * distance
    return DISTANCE_ERROR * distance, ANGLE_ERROR * turned
