"""Odometry of a rover from its messages: of its wheels, or of the autopilot's own filter.

Neither takes over positions: they jump when a GPS receiver finds itself. Velocities, turns and
distances are summed up, so that the pose drifts and never jumps, as the odom frame must.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import cos, hypot, sin
from typing import Any

from stack.drivetrain.drivetrain import Drivetrain
from stack.drivetrain.kinematics import moved
from stack.mavlink.frames import enu_from_ned, enu_heading
from stack.types import STANDSTILL, Odometry, Pose2D, Twist, wrap_angle

LONGEST_AHEAD = 0.2
"""Seconds by which a pose is predicted at most from the newest message."""

GAP = 1.0
"""Seconds between two messages beyond which what happened between them is not guessed."""

YAW_RESET = 0.3
"""Radians by which the yaw may differ from the sum of the yaw rates between two messages; more is a
correction of the autopilot's filter, not a turn."""

QUIET_SPEED, QUIET_TURN = 0.1, 0.05
"""Velocities that a filter may report of a rover that stands, m/s and rad/s."""


class RoverOdometry(ABC):
    """Sums up the motion; `at` gives pose and velocity at a time.

    Attributes:
        stamp: of the newest message, seconds on our clock; None before the first.
        heard: when the newest message came, seconds; None before the first.
        stands: whether the rover has been told to stand for a while: then small velocities are
            noise, and are not summed up.
    """

    def __init__(self) -> None:
        self.stamp: float | None = None
        self.heard: float | None = None
        self.stands = False
        self._pose, self._twist = Pose2D(0.0, 0.0), STANDSTILL

    @abstractmethod
    def add(self, kind: str, message: Any, stamp: float) -> None:
        """Process a message.

        Args:
            kind: name of the message.
            message: of pymavlink.
            stamp: seconds on our clock.
        """

    def at(self, now: float) -> Odometry:
        """Pose and velocity at a time: those of the newest message and the motion since.

        Args:
            now: seconds on our clock.
        """
        age = 0.0 if self.stamp is None else now - self.stamp
        twist = STANDSTILL if age > GAP or self._is_noise(self._twist) else self._twist
        ahead = min(max(age, 0.0), LONGEST_AHEAD)
        return Odometry(now, self._pose.compose(moved(twist, ahead)), twist)

    def _is_noise(self, twist: Twist) -> bool:
        quiet = hypot(twist.linear, twist.lateral) < QUIET_SPEED
        return self.stands and quiet and abs(twist.angular) < QUIET_TURN


class FilterOdometry(RoverOdometry):
    """Velocity (LOCAL_POSITION_NED) and attitude (ATTITUDE) of the autopilot's filter."""

    def __init__(self) -> None:
        super().__init__()
        self._yaw: float | None = None
        self._heading, self._turned_at, self._rate = 0.0, 0.0, 0.0
        self._velocity = (0.0, 0.0)

    def add(self, kind: str, message: Any, stamp: float) -> None:
        """Process ATTITUDE and LOCAL_POSITION_NED; others are ignored."""
        if kind == "ATTITUDE":
            self._turn(enu_heading(message.yaw), -float(message.yawspeed), stamp)
        elif kind == "LOCAL_POSITION_NED" and self._yaw is not None:
            east, north, _ = enu_from_ned((message.vx, message.vy, 0.0))
            self._move(east, north, stamp)

    def _turn(self, yaw: float, rate: float, stamp: float) -> None:
        elapsed = stamp - self._turned_at
        if self._yaw is not None:
            if elapsed <= 0.0:
                return  # overtaken
            turned = wrap_angle(yaw - self._yaw)
            if elapsed <= GAP:
                expected = 0.5 * (rate + self._rate) * elapsed
                if abs(wrap_angle(turned - expected)) > YAW_RESET:
                    turned = expected
            self._heading = wrap_angle(self._heading + turned)
        self._yaw, self._turned_at, self._rate = yaw, stamp, rate

    def _move(self, east: float, north: float, stamp: float) -> None:
        assert self._yaw is not None
        aligned = self._heading - self._yaw  # from the filter's frame to the odom frame
        c, s = cos(aligned), sin(aligned)
        velocity = (c * east - s * north, s * east + c * north)
        heading = self._heading + self._rate * (stamp - self._turned_at)
        x, y = self._pose.x, self._pose.y
        if self.stamp is not None:
            elapsed = stamp - self.stamp
            if elapsed <= 0.0:
                return
            if elapsed <= GAP and not self._is_noise(self._twist):
                x += 0.5 * (self._velocity[0] + velocity[0]) * elapsed
                y += 0.5 * (self._velocity[1] + velocity[1]) * elapsed
        self.stamp, self._velocity = stamp, velocity
        self._pose = Pose2D(x, y, wrap_angle(heading))
        c, s = cos(heading), sin(heading)
        self._twist = Twist(
            c * velocity[0] + s * velocity[1], self._rate, c * velocity[1] - s * velocity[0]
        )


class WheelOdometry(RoverOdometry):
    """Distances that the wheels have rolled (WHEEL_DISTANCE): left first, then right.

    Args:
        drivetrain: with two sides.
    """

    def __init__(self, drivetrain: Drivetrain) -> None:
        super().__init__()
        self._drivetrain = drivetrain
        self._rolled: tuple[float, float] | None = None

    def add(self, kind: str, message: Any, stamp: float) -> None:
        """Process WHEEL_DISTANCE; others are ignored."""
        if kind != "WHEEL_DISTANCE" or message.count < 2:
            return
        rolled = (float(message.distance[0]), float(message.distance[1]))
        if self._rolled is not None and self.stamp is not None:
            elapsed = stamp - self.stamp
            if elapsed <= 0.0:
                return
            if elapsed <= GAP:  # else the encoders may have been reset meanwhile
                steps = [now - before for now, before in zip(rolled, self._rolled, strict=True)]
                step = self._drivetrain.from_wheels(steps, (0.0, 0.0))
                per_second = 1.0 / elapsed
                self._twist = Twist(
                    step.x * per_second, step.heading * per_second, step.y * per_second
                )
                self._pose = self._pose.compose(moved(self._twist, elapsed))
        self._rolled, self.stamp = rolled, stamp
