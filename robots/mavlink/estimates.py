"""Our estimate of the pose as messages for the rover's filter.

VISION_POSITION_ESTIMATE has the pose on the map as north, east and yaw, with the map's x axis taken
as east. ODOMETRY has it in LOCAL_FRD, whose x axis is the map's, with the velocity of the base.
ArduPilot takes no other frames, and drops them silently.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from math import cos, inf, sin
from typing import Any

from stack.mavlink.frames import (
    Matrix3,
    Planar,
    frd_covariance,
    frd_pose,
    frd_twist,
    ned_covariance,
    ned_pose,
    pack_covariance,
)

OLDEST = 0.3
"""Seconds for which an estimate of a moving rover is sent; then the rover's filter must notice that
there is none."""

LOCAL_FRD, BODY_FRD = 20, 12
ESTIMATOR_VISION = 2
SPEED_VARIANCE = 0.05**2
SPEED_COVARIANCE = (
    (SPEED_VARIANCE, 0.0, 0.0), (0.0, SPEED_VARIANCE, 0.0), (0.0, 0.0, SPEED_VARIANCE),
)  # fmt: skip
FIRST_COVARIANCE: Matrix3 = ((0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (0.0, 0.0, 0.01))
"""Of the pose at which a rover is said to stand before it has been estimated: 0.1 m, 0.1 rad."""

_LAYOUT = struct.Struct("=16dB")


@dataclass(frozen=True, slots=True)
class SentEstimate:
    """An estimate on its way to the rover.

    Attributes:
        pose: x, y, heading on the map.
        covariance: of x, y, heading.
        twist: linear, lateral and angular velocity of the base.
        resets: number of jumps of the pose so far, modulo 256.
        until: seconds on the monotonic clock until which it is sent; inf: while the rover stands.
    """

    pose: Planar
    covariance: Matrix3 = FIRST_COVARIANCE
    twist: Planar = (0.0, 0.0, 0.0)
    resets: int = 0
    until: float = inf

    def packed(self) -> bytes:
        """Return it as bytes, for the process of the fast loop."""
        a, b, c = self.covariance
        return _LAYOUT.pack(*self.pose, *a, *b, *c, *self.twist, self.until, self.resets)

    @classmethod
    def unpacked(cls, content: bytes) -> SentEstimate:
        """Return the estimate in bytes."""
        n = _LAYOUT.unpack(content)
        return cls(n[0:3], (n[3:6], n[6:9], n[9:12]), n[12:15], n[16], n[15])

    def message(self, kind: str, dialect: Any, now: float) -> Any | None:
        """Return the message that is sent now; None if the estimate is too old.

        Args:
            kind: vision_position or odometry.
            dialect: pymavlink's module with messages.
            now: seconds on the monotonic clock.
        """
        if now > self.until:
            return None
        microseconds = int(now * 1e6)
        if kind == "vision_position":
            north, east, yaw = ned_pose(*self.pose)
            return dialect.MAVLink_vision_position_estimate_message(
                microseconds, north, east, 0.0, 0.0, 0.0, yaw,
                pack_covariance(ned_covariance(self.covariance)), self.resets,
            )  # fmt: skip
        x, y, yaw = frd_pose(*self.pose)
        forward, right, rate = frd_twist(*self.twist)
        return dialect.MAVLink_odometry_message(
            microseconds, LOCAL_FRD, BODY_FRD, x, y, 0.0,
            [cos(yaw / 2.0), 0.0, 0.0, sin(yaw / 2.0)], forward, right, 0.0, 0.0, 0.0, rate,
            pack_covariance(frd_covariance(self.covariance)), pack_covariance(SPEED_COVARIANCE),
            self.resets, ESTIMATOR_VISION, 100,
        )  # fmt: skip
