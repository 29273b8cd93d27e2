"""Our estimate of the pose as messages for the rover's filter.

VISION_POSITION_ESTIMATE has the pose on the map as north, east and yaw, with the map's x axis taken
as east. ODOMETRY has it in LOCAL_FRD, whose x axis is the map's, with the velocity of the base.
ArduPilot takes no other frames, and drops them silently.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin
from typing import Any

from stack.mavlink.frames import (
    frd_covariance,
    frd_pose,
    frd_twist,
    ned_covariance,
    ned_pose,
    pack_covariance,
)
from stack.types import STANDSTILL, Pose2D, PoseEstimate, Twist, has_jumped

OLDEST = 0.3
"""Seconds for which an estimate of a moving rover is sent; then the rover's filter must notice that
there is none."""

LOCAL_FRD, BODY_FRD = 20, 12
ESTIMATOR_VISION = 2
SPEED_VARIANCE = 0.05**2
SPEED_COVARIANCE = (
    (SPEED_VARIANCE, 0.0, 0.0), (0.0, SPEED_VARIANCE, 0.0), (0.0, 0.0, SPEED_VARIANCE),
)  # fmt: skip
NO_ESTIMATE: Sequence[Sequence[float]] = ((0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01))


class EstimateSender:
    """Makes messages of the newest estimate. The loop sets it, the link's thread sends it.

    Args:
        kind: vision_position or odometry.
        start: where the rover stands until the first estimate, map frame.
    """

    def __init__(self, kind: str, start: Pose2D) -> None:
        self._kind = kind
        self._last: PoseEstimate | None = None
        self._resets = 0
        # Pose, covariance, velocity, resets, and until when it is sent: replaced as one.
        self._now: tuple[Pose2D, Any, Twist, int, float | None] = (
            start, NO_ESTIMATE, STANDSTILL, 0, None,
        )  # fmt: skip

    def accept(self, estimate: PoseEstimate, twist: Twist, now: float) -> None:
        """Take a newer estimate; a lost robot has none.

        Args:
            estimate: of the pose.
            twist: measured velocity of the base.
            now: seconds on the clock of the link.
        """
        if self._last is not None and has_jumped(self._last, estimate):
            self._resets = (self._resets + 1) % 256
        self._last = estimate
        if not estimate.is_lost:
            until = now + OLDEST
            self._now = (estimate.pose, estimate.covariance, twist, self._resets, until)

    def message(self, dialect: Any, now: float) -> Any | None:
        """Return the message that is sent now; None without a fresh estimate."""
        pose, covariance, twist, resets, until = self._now
        if until is not None and now > until:
            return None
        microseconds = int(now * 1e6)
        if self._kind == "vision_position":
            north, east, yaw = ned_pose(pose.x, pose.y, pose.heading)
            return dialect.MAVLink_vision_position_estimate_message(
                microseconds, north, east, 0.0, 0.0, 0.0, yaw,
                pack_covariance(ned_covariance(covariance)), resets,
            )  # fmt: skip
        x, y, yaw = frd_pose(pose.x, pose.y, pose.heading)
        forward, right, rate = frd_twist(twist.linear, twist.lateral, twist.angular)
        return dialect.MAVLink_odometry_message(
            microseconds, LOCAL_FRD, BODY_FRD, x, y, 0.0,
            [cos(yaw / 2.0), 0.0, 0.0, sin(yaw / 2.0)], forward, right, 0.0, 0.0, 0.0, rate,
            pack_covariance(frd_covariance(covariance)), pack_covariance(SPEED_COVARIANCE), resets,
            ESTIMATOR_VISION, 100,
        )  # fmt: skip
