"""Collision monitor: checks a twist against the obstacle points around the robot."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.types import FloatArray, Twist


@dataclass(frozen=True, slots=True)
class Contact:
    """First contact of a twist with an obstacle point.

    Attributes:
        time: seconds at this twist until the first point is within the padding; inf: none.
        x: current position of that point, base frame, metres.
        y: current position of that point, base frame, metres.
    """

    time: float
    x: float = 0.0
    y: float = 0.0


NOTHING_NEAR = Contact(inf)


class CollisionMonitor:
    """Sweeps the footprint along a twist against obstacle points, without a costmap."""

    SLACK = 0.005

    def __init__(self, robot: RobotDescription) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._corners = np.ascontiguousarray(robot.footprint.points, dtype=np.float64)
        self._radius = robot.footprint.circumscribed_radius

    def contact(self, twist: Twist, points: FloatArray, horizon: float, padding: float) -> Contact:
        """Return the first contact of a twist.

        Args:
            twist: to check.
            points: (m, 2) obstacle points, base frame, metres.
            horizon: seconds to look ahead.
            padding: distance kept free around the footprint, metres.
        """
        time, which = self._kernels.time_to_contact(
            points, self._corners, self._radius, padding, self.SLACK,
            twist.linear, twist.lateral, twist.angular, horizon,
        )  # fmt: skip
        return Contact(time, *points[which]) if which >= 0 else NOTHING_NEAR
