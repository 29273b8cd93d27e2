"""Error of a motion by odometry between two scans, apart from kernels."""

from __future__ import annotations

from math import hypot

import numpy as np

from stack.types import FloatArray, Pose2D

DISTANCE_ERROR, ANGLE_ERROR = 0.15, 0.15
"""Standard deviations per metre driven and per radian turned: wheels that slip. Matches correct
smaller errors, and larger ones are searched."""

TURN_OF_METRE = 0.3
"""Radians turned that a metre driven counts as, for the heading."""

DEVIATION_FLOOR = 0.01
"""Metres and radians; deviation of odometry without any motion."""

FASTEST = 2.5
"""Metres and radians per second. A slower motion over a gap in the scans is believed: in a corridor
the last pose would fit as well."""

JUMP = 5.0
"""Metres in one step, faster than FASTEST, that no robot drives."""


def odometry_deviation(moved: Pose2D, floor: float = DEVIATION_FLOOR) -> tuple[float, float]:
    """Return the standard deviations of position (m) and heading (rad) of a motion by odometry."""
    distance = hypot(moved.x, moved.y)
    turned = abs(moved.heading) + TURN_OF_METRE * distance
    return floor + DISTANCE_ERROR * distance, floor + ANGLE_ERROR * turned


def odometry_covariance(moved: Pose2D, floor: float = DEVIATION_FLOOR) -> FloatArray:
    """Return the covariance (3, 3) of x, y and heading of a motion by odometry."""
    position, heading = odometry_deviation(moved, floor)
    return np.diag(np.square([position, position, heading]))


def odometry_information(moved: Pose2D) -> FloatArray:
    """Return the information (3, 3) of x, y and heading of a motion by odometry."""
    position, heading = odometry_deviation(moved)
    return np.diag([position**-2, position**-2, heading**-2])


def is_jump(moved: Pose2D, elapsed: float) -> bool:
    """Return whether no robot drives a motion in so many seconds: odometry was reset."""
    return hypot(moved.x, moved.y) > max(JUMP, FASTEST * elapsed)
