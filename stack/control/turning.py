"""Turns in place: collision-checked, stopping on the heading wanted."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, pi

from stack.components import ControlState
from stack.control.ramps import Ramp, stopping_speed
from stack.control.swept import SweptFootprint
from stack.types import Twist

SLOWEST = 0.08
"""rad/s below which many drives stick."""


@dataclass(frozen=True, slots=True)
class TurnStyle:
    """How to turn: top speed (rad/s), share of the acceleration to brake with, error to stop at."""

    speed: float
    brake_share: float
    precision: float


class TurnInPlace:
    """Turns by an angle, the other way round if only that is free."""

    def __init__(self, swept: SweptFootprint, ramp: Ramp, style: TurnStyle) -> None:
        self._swept, self._ramp, self._style = swept, ramp, style

    def twist(self, state: ControlState, last: Twist, angle: float) -> Twist | None:
        """The next command of a turn, None when both ways are blocked.

        Args:
            state: where the robot is.
            last: the command before, still braking to a stand perhaps.
            angle: left to turn, radians, positive to the left.
        """
        linear, lateral = map(self._braked, (last.linear, last.lateral))
        if abs(angle) <= self._style.precision:
            return Twist(linear, 0.0, lateral)
        for way in (angle, angle - copysign(2.0 * pi, angle)):
            turn = Twist(angular=copysign(1.0, way))
            free, _ = self._swept.arc(state.costs, state.pose, turn, abs(way))
            if free == inf:
                return Twist(linear, self._ramp.turn(last.angular, self._speed(way)), lateral)
        return None

    def _braked(self, speed: float) -> float:
        slower = max(0.0, abs(speed) - self._ramp.limits.linear_deceleration * self._ramp.period)
        return copysign(slower, speed) if slower else 0.0

    def _speed(self, angle: float) -> float:
        rate = turning_speed(angle, self._style, self._ramp)
        return copysign(max(abs(rate), SLOWEST), angle)


def turning_speed(angle: float, style: TurnStyle, ramp: Ramp) -> float:
    """The turning speed (rad/s) with an angle left to turn, from which it still stops on it."""
    top = min(style.speed, ramp.limits.angular_speed)
    late = ramp.response_time + ramp.period
    way = abs(angle) - 0.5 * style.precision
    rate = stopping_speed(way, style.brake_share * ramp.limits.angular_acceleration, late)
    return copysign(min(top, rate), angle)
