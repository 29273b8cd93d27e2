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
        fall = self._ramp.limits.linear_deceleration * self._ramp.period
        linear = max(0.0, abs(last.linear) - fall)
        linear = copysign(linear, last.linear) if linear else 0.0
        if abs(angle) <= self._style.precision:
            return Twist(linear, 0.0)
        for way in (angle, angle - copysign(2.0 * pi, angle)):
            free, _ = self._swept.arc(state.costs, state.pose, 0.0, copysign(1.0, way), abs(way))
            if free == inf:
                return Twist(linear, self._ramp.turn(last.angular, self._speed(way)))
        return None

    def _speed(self, angle: float) -> float:
        limits, style = self._ramp.limits, self._style
        top = min(style.speed, limits.angular_speed)
        late = self._ramp.response_time + self._ramp.period
        way = abs(angle) - 0.5 * style.precision
        rate = stopping_speed(way, style.brake_share * limits.angular_acceleration, late)
        return copysign(min(top, max(rate, SLOWEST)), angle)
