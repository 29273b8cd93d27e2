"""Limit of the speed at which a robot enters ground that no sensor has seen."""

from __future__ import annotations

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.geometry.polygons import outline_points
from stack.types import SeenGround, Twist

SPACING = 0.03
"""Metres between the points of the outline that are followed."""


class UnseenGroundLimit:
    """Follows the outline of a robot along a twist into unseen ground.

    A robot that is blind behind sweeps this ground with its rear corners when it turns in place.
    """

    def __init__(self, robot: RobotDescription) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._outline = np.ascontiguousarray(outline_points(robot.footprint.points, SPACING))

    def share(
        self, twist: Twist, ground: SeenGround, reaction: float, braking: float, slowest: float
    ) -> float:
        """Return the share of a twist at which no point of the outline enters faster than allowed.

        Args:
            twist: to check.
            ground: which ground was seen.
            reaction: seconds before the robot brakes.
            braking: seconds at this twist that cover its braking distance.
            slowest: speed of a point of the outline in unseen ground, m/s.
        """
        return float(
            self._kernels.share_where_unseen(
                self._outline, ground.stamps, *ground.corner, ground.cell, ground.oldest,
                ground.base.x, ground.base.y, ground.base.heading, ground.views,
                twist.linear, twist.lateral, twist.angular, reaction, braking, slowest,
            )
        )  # fmt: skip
