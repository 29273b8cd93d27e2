"""From velocity commands to wheel speeds: limits, ramps and the dead-man stop."""

from __future__ import annotations

from stack.body import DEAD_MAN
from stack.description import Limits, Wheels
from stack.types import STANDSTILL, Twist


class Drive:
    """A differential drive's controller, advanced once every physics step.

    Linear and angular velocity ramp on their own, each at its acceleration limit, and turn into
    wheel speeds (v -+ w b / 2) / r with track b and wheel radius r.

    Attributes:
        linear: the velocity that the wheels are told now, m/s.
        angular: likewise, rad/s.
    """

    def __init__(self, limits: Limits, wheels: Wheels, period: float) -> None:
        self._limits, self._wheels = limits, wheels
        self._up = limits.linear_acceleration * period
        self._down = limits.linear_deceleration * period
        self._turn = limits.angular_acceleration * period
        self._patience = round(DEAD_MAN / period)
        self._target = STANDSTILL
        self._silent = self._patience
        self.linear = self.angular = 0.0

    def command(self, twist: Twist) -> None:
        """Aim for a velocity, cut to what the drive can do."""
        limits = self._limits
        self._target = Twist(
            min(max(twist.linear, -limits.reverse_speed), limits.linear_speed),
            min(max(twist.angular, -limits.angular_speed), limits.angular_speed),
        )
        self._silent = 0

    def halt(self) -> None:
        """Stand still at once: the robot was lifted."""
        self._target = STANDSTILL
        self.linear = self.angular = 0.0

    def advance(self) -> bool:
        """One physics step; whether the wheel speeds changed."""
        self._silent += 1
        target = self._target if self._silent <= self._patience else STANDSTILL
        if self.linear == target.linear and self.angular == target.angular:
            return False
        self.linear = self._ramp(target.linear)
        gap = target.angular - self.angular
        self.angular += min(max(gap, -self._turn), self._turn)
        if abs(gap) <= self._turn:
            self.angular = target.angular
        return True

    @property
    def wheel_speeds(self) -> tuple[float, float]:
        """Left and right, rad/s."""
        sideways = self.angular * self._wheels.separation / 2.0
        radius = self._wheels.radius
        return (self.linear - sideways) / radius, (self.linear + sideways) / radius

    def _ramp(self, target: float) -> float:
        now = self.linear
        slowing = now * target < 0.0 or abs(target) < abs(now)
        step = self._down if slowing else self._up
        if slowing and now * target < 0.0:
            target = 0.0  # first stop, then speed up the other way
        if abs(target - now) <= step:
            return target
        return now + (step if target > now else -step)
