"""Turns in place with collision checks and braking at the target heading; when to turn first."""

from __future__ import annotations

from dataclasses import dataclass
from math import asin, copysign, inf, pi

from stack.components import ControlState
from stack.control.ramps import Ramp, stopping_speed
from stack.control.swept import SweptFootprint
from stack.geometry.path_segment import PathSegment
from stack.types import Pose2D, Twist, wrap_angle

BRAKE_SHARE = 0.5
"""Share of the robot's deceleration that is used for braking; the rest is reserve."""

SLOWEST_TURN = 0.08
"""Turning speed in rad/s below which many drives do not move; less only to end more exactly."""


CLOSE_TO_GOAL = 0.15
"""Distance in metres to the goal below which smaller angles to it also start a turn."""

STANDING_SPEED = 0.1
"""Speed in m/s up to which a turn starts; above it only when the path is behind."""

BEHIND_ANGLE = 2.0
"""Angle in radians above which the path is behind the robot."""


@dataclass(frozen=True, slots=True)
class TurnStyle:
    """Top speed (rad/s) and final heading error (rad)."""

    speed: float
    precision: float


class TurnInPlace:
    """Turns by an angle, in the opposite direction if only that is clear.

    Attributes:
        style: of the turns.
    """

    def __init__(self, swept: SweptFootprint, ramp: Ramp, style: TurnStyle) -> None:
        self._swept, self._ramp, self.style = swept, ramp, style

    def adopt(self, style: TurnStyle) -> None:
        """Turn in another style from now on."""
        self.style = style

    def twist(self, state: ControlState, last: Twist, angle: float) -> Twist | None:
        """Return the next command of a turn, None when both directions are blocked.

        Args:
            state: of the robot.
            last: the previous command; the robot may still be braking.
            angle: remaining angle, radians, positive to the left.
        """
        linear, lateral = (self._ramp.forward(speed, 0.0) for speed in (last.linear, last.lateral))
        if abs(angle) <= self.style.precision:
            return Twist(linear, 0.0, lateral)
        for option in (angle, angle - copysign(2.0 * pi, angle)):
            turn = Twist(angular=copysign(1.0, option))
            free, _ = self._swept.arc(state.costs, state.pose, turn, abs(option))
            if free == inf:
                return Twist(linear, self._ramp.turn(last.angular, self._speed(option)), lateral)
        return None

    def free_twist(self, last: Twist, angle: float) -> Twist:
        """Return the next command of a turn whatever is near: a round robot touches nothing by it.

        Its outline is a polygon whose corners `twist` keeps off what the robot touches.
        """
        linear, lateral = (self._ramp.forward(speed, 0.0) for speed in (last.linear, last.lateral))
        return Twist(linear, self._ramp.turn(last.angular, self._speed(angle)), lateral)

    def _speed(self, angle: float) -> float:
        rate, delay = turning_speed(angle, self.style, self._ramp), _delay(self._ramp)
        return copysign(max(abs(rate), min(SLOWEST_TURN, self.style.precision / delay)), angle)


def _delay(ramp: Ramp) -> float:
    return ramp.response_time + ramp.period


def turning_speed(angle: float, style: TurnStyle, ramp: Ramp) -> float:
    """Highest turning speed (rad/s) that still stops at the remaining angle (radians)."""
    top = min(style.speed, ramp.limits.angular_speed)
    delay = _delay(ramp)
    distance = abs(angle) - 0.5 * style.precision
    rate = stopping_speed(distance, BRAKE_SHARE * ramp.limits.angular_acceleration, delay)
    return copysign(min(top, rate), angle)


class RotationShim:
    """Decides when to turn in place first, like Nav2's rotation shim controller.

    Args:
        lookahead: distance of the path point to turn towards, metres.
        disengage: share of the starting angle at which a turn ends.
    """

    def __init__(self, lookahead: float, disengage: float) -> None:
        self._lookahead, self._disengage = lookahead, disengage
        self._turning = False

    def angle(
        self, segment: PathSegment, state: ControlState, least: float, precision: float
    ) -> float | None:
        """Return the angle to turn by, radians; None when the robot can drive along the path.

        Args:
            segment: that the robot drives, up to date with its pose.
            state: of the robot.
            least: angle to the path that starts a turn, radians.
            precision: position tolerance at the goal, metres.
        """
        pose, goal = state.pose, segment.path.goal
        distance = pose.distance_to(goal)
        if segment.remaining > self._lookahead:
            x, y = segment.nearer_point(pose, self._lookahead)
            goal = Pose2D(x, y)
        elif distance <= precision:
            self._turning = False
            return None
        elif distance <= CLOSE_TO_GOAL:
            least = min(least, asin(precision / distance))
        angle = wrap_angle(pose.bearing_to(goal) - pose.heading)
        if self._turning:
            self._turning = abs(angle) > self._disengage * least
        else:
            standing = abs(state.twist.linear) <= STANDING_SPEED
            self._turning = abs(angle) > (least if standing else max(least, BEHIND_ANGLE))
        return angle if self._turning else None
