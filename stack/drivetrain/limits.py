"""Limits of speed and acceleration, and the change of speed that they allow."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign

import numpy as np

from stack.parameters import parameter
from stack.types import FloatArray, Twist

STOP_DECELERATION = 3.0
"""m/s² that wheels hold without sliding: µ g, times the share of the weight on the driven wheels,
with µ = 0.6 of rubber on a dry hard floor and half of the weight."""


@dataclass(frozen=True)
class Limits:
    """Limits of speed and acceleration of a drive."""

    linear_speed: float = parameter(0.8, "m/s", above=0.0, help="maximum speed forward")
    reverse_speed: float = parameter(0.3, "m/s", at_least=0.0, help="maximum speed backward")
    lateral_speed: float = parameter(
        0.0, "m/s", at_least=0.0, help="maximum speed sideways; omnidirectional robots only"
    )
    angular_speed: float = parameter(1.8, "rad/s", above=0.0, help="maximum turning speed")
    linear_acceleration: float = parameter(1.0, "m/s²", above=0.0, help="speeding up")
    linear_deceleration: float = parameter(1.5, "m/s²", above=0.0, help="slowing down")
    stop_deceleration: float = parameter(
        STOP_DECELERATION, "m/s²", above=0.0,
        help="of the fastest wheel in an emergency stop and without commands; at least "
        "linear_deceleration",
    )  # fmt: skip
    angular_acceleration: float = parameter(
        3.2, "rad/s²", above=0.0, help="turning, in both directions"
    )
    linear_jerk: float = parameter(
        0.0, "m/s³", at_least=0.0, help="change of acceleration; 0: no limit"
    )
    angular_jerk: float = parameter(
        0.0, "rad/s³", at_least=0.0, help="change of the acceleration in turning; 0: no limit"
    )

    @property
    def stop(self) -> float:
        """Deceleration of an emergency stop, m/s²: no stop is softer than usual braking."""
        return max(self.stop_deceleration, self.linear_deceleration)

    def clipped(self, twist: Twist) -> Twist:
        """Clip each component of a twist to its maximum speed."""
        return Twist(
            min(max(twist.linear, -self.reverse_speed), self.linear_speed),
            min(max(twist.angular, -self.angular_speed), self.angular_speed),
            min(max(twist.lateral, -self.lateral_speed), self.lateral_speed),
        )

    def limit_linear(self, last: float, wanted: float, period: float) -> float:
        """Forward speed after one period on the way from `last` to `wanted`, m/s."""
        return limit_speed(last, wanted, period, self.linear_acceleration, self.linear_deceleration)

    def limit_angular(self, last: float, wanted: float, period: float) -> float:
        """Turning speed after one period on the way from `last` to `wanted`, rad/s."""
        change = self.angular_acceleration
        return limit_speed(last, wanted, period, change, change)


def limit_speed(last: float, wanted: float, period: float, rise: float, fall: float) -> float:
    """Speed after one period on the way from `last` to `wanted`.

    The magnitude rises at most at `rise` and falls at most at `fall`, in both directions. When the
    direction changes, the speed first falls to zero and rises for the rest of the period; with
    equal limits zero is a speed like any other.

    Args:
        last: m/s or rad/s.
        wanted: in the same unit.
        period: seconds.
        rise: limit of speeding up, m/s² or rad/s².
        fall: limit of slowing down, m/s² or rad/s².
    """
    if rise != fall and last * wanted < 0.0:
        stopping = abs(last) / fall
        if stopping >= period:
            return last - copysign(fall * period, last)
        last, period = 0.0, period - stopping
    most = (fall if abs(wanted) < abs(last) else rise) * period
    if abs(wanted - last) <= most:
        return wanted
    return last + copysign(most, wanted - last)


def limit_speeds(
    last: float, wanted: FloatArray, times: FloatArray, rise: float, fall: float
) -> FloatArray:
    """`limit_speed` for n wanted speeds after each of k times: (n, k).

    Args:
        last: m/s or rad/s.
        wanted: (n,) in the same unit.
        times: (k,) seconds.
        rise: limit of speeding up, m/s² or rad/s².
        fall: limit of slowing down, m/s² or rad/s².
    """
    target = wanted[:, None]
    turns_back = (rise != fall) & (target * last < 0.0)
    start = np.where(turns_back, 0.0, last)
    left = times - np.where(turns_back, abs(last) / fall, 0.0)
    most = np.where(np.abs(target) < np.abs(start), fall, rise) * np.maximum(left, 0.0)
    reached = start + np.clip(target - start, -most, most)
    braking: FloatArray = np.where(left < 0.0, last - copysign(fall, last) * times, reached)
    return braking
