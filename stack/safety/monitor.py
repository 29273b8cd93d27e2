"""Checks a twist against the obstacle points around the robot, and against unseen ground."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, cos, hypot, inf, pi, sin

import numpy as np

from stack.drivetrain.description import RobotDescription
from stack.geometry.polygons import outline_points
from stack.safety.parameters import PADDING_SLACK
from stack.types import NOTHING_MOVES, FloatArray, Pose2D, SeenGround, TrackedObject, Twist


@dataclass(frozen=True, slots=True)
class Contact:
    """First contact of a twist with an obstacle point or a moving object.

    Attributes:
        time: seconds at this twist until the first one is within the padding; inf: none.
        x: its current position, base frame, metres.
        y: likewise.
        moves: whether it is a moving object.
    """

    time: float
    x: float = 0.0
    y: float = 0.0
    moves: bool = False

    @property
    def place(self) -> str:
        """Its distance from the base and its side, for displays: `0.7 m behind`."""
        words = ("ahead", "to the left", "behind", "to the right")
        side = words[round(atan2(self.y, self.x) / (0.5 * pi)) % 4]
        return f"{hypot(self.x, self.y):.1f} m {side}"


NOTHING_NEAR = Contact(inf)


class CollisionMonitor:
    """Sweeps the footprint along a twist against obstacle points, without a costmap.

    Points stand still; moving objects keep their velocity. A round robot that turns in place
    touches no point.
    """

    def __init__(self, robot: RobotDescription) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._corners = np.ascontiguousarray(robot.footprint.points, dtype=np.float64)
        self._radius = robot.footprint.circumscribed_radius
        self._is_round = robot.footprint.is_round

    def contact(  # noqa: PLR0913 - one motion, and what it may meet
        self, twist: Twist, points: FloatArray, horizon: float, padding: float,
        moving: FloatArray = NOTHING_MOVES, moving_padding: float = 0.0,
    ) -> Contact:  # fmt: skip
        """Return the first contact of a twist.

        Args:
            twist: to check.
            points: (m, 2) obstacle points, base frame, metres.
            horizon: seconds to look ahead.
            padding: distance kept free around the footprint, metres.
            moving: (k, 5) moving objects, as `moving_discs` returns them.
            moving_padding: distance kept free to those that walk, if larger than `padding`.
        """
        found = NOTHING_NEAR
        if twist.linear or twist.lateral or not self._is_round:
            time, which = self._kernels.time_to_contact(
                points, self._corners, self._radius, padding, PADDING_SLACK,
                twist.linear, twist.lateral, twist.angular, horizon,
            )  # fmt: skip
            found = Contact(time, *points[which]) if which >= 0 else NOTHING_NEAR
        if not len(moving):
            return found
        time, which = self._kernels.time_to_meeting(
            moving, self._corners, self._radius, padding, PADDING_SLACK,
            twist.linear, twist.lateral, twist.angular, horizon, moving_padding,
        )  # fmt: skip
        if time >= found.time:
            return found
        x, y = moving[which, :2]
        return Contact(time, x, y, moves=True)


def moving_discs(tracks: Sequence[TrackedObject], base: Pose2D) -> FloatArray:
    """Tracked objects as discs in the base frame.

    Args:
        tracks: at the time of the base's pose.
        base: pose in the frame of the tracks.

    Returns:
        (k, 5) x, y, velocity x, velocity y (over the ground), radius; metres and m/s.
    """
    if not tracks:
        return NOTHING_MOVES
    c, s = cos(base.heading), sin(base.heading)
    into_base = np.array([[c, -s], [s, c]])
    discs = np.array([(*track.position, *track.velocity, track.radius) for track in tracks])
    discs[:, :2] = (discs[:, :2] - (base.x, base.y)) @ into_base
    discs[:, 2:4] = discs[:, 2:4] @ into_base
    return discs


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
