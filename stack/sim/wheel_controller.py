"""From velocity commands to wheel speeds: limits, ramps and the dead-man stop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import atan, tan

from stack.body import DEAD_MAN
from stack.drivetrain.description import Limits, OmniWheels, RobotDescription, SteeredWheels, Wheels
from stack.types import STANDSTILL, Twist


class WheelController(ABC):
    """The wheels' controller of some kind of robot, advanced once every physics step.

    Attributes:
        linear: the velocity that the wheels are told now, m/s.
        lateral: likewise, m/s to the left.
        angular: likewise, rad/s.
    """

    def __init__(self, limits: Limits, period: float) -> None:
        self._limits = limits
        self._up = limits.linear_acceleration * period
        self._down = limits.linear_deceleration * period
        self._turn = limits.angular_acceleration * period
        self._patience = round(DEAD_MAN / period)
        self._target = STANDSTILL
        self._silent = self._patience
        self.linear = self.lateral = self.angular = 0.0

    def command(self, twist: Twist) -> None:
        """Aim for a velocity, cut to what the drive can do."""
        self._target = self._cut(twist)
        self._silent = 0

    def halt(self) -> None:
        """Stand still at once: the robot was lifted."""
        self._target = STANDSTILL
        self.linear = self.lateral = self.angular = 0.0

    def advance(self) -> bool:
        """One physics step; whether wheel speeds or steering changed."""
        self._silent += 1
        return self._approach(self._target if self._silent <= self._patience else STANDSTILL)

    @property
    @abstractmethod
    def wheel_speeds(self) -> tuple[float, ...]:
        """Of each driven wheel, rad/s, in the order of the description."""

    @property
    def steering(self) -> tuple[float, ...]:
        """Angles of the steered wheels, left and right, radians; empty where none are."""
        return ()

    @abstractmethod
    def _approach(self, target: Twist) -> bool:
        """One physics step towards a velocity; whether anything changed."""

    def _cut(self, twist: Twist) -> Twist:
        limits = self._limits
        return Twist(
            min(max(twist.linear, -limits.reverse_speed), limits.linear_speed),
            min(max(twist.angular, -limits.angular_speed), limits.angular_speed),
            min(max(twist.lateral, -limits.lateral_speed), limits.lateral_speed),
        )

    def _ramp(self, now: float, target: float) -> float:
        """The next speed, m/s, on the way from one to another."""
        slowing = now * target < 0.0 or abs(target) < abs(now)
        step = self._down if slowing else self._up
        if slowing and now * target < 0.0:
            target = 0.0  # first stop, then speed up the other way
        if abs(target - now) <= step:
            return target
        return now + (step if target > now else -step)

    def _approach_freely(self, target: Twist) -> bool:
        """Ramp each velocity on its own, at its acceleration limit."""
        if (self.linear, self.lateral, self.angular) == (
            target.linear, target.lateral, target.angular,
        ):  # fmt: skip
            return False
        self.linear = self._ramp(self.linear, target.linear)
        self.lateral = self._ramp(self.lateral, target.lateral)
        gap = target.angular - self.angular
        self.angular += min(max(gap, -self._turn), self._turn)
        if abs(gap) <= self._turn:
            self.angular = target.angular
        return True


class DifferentialController(WheelController):
    """Two sides of wheels: (v -+ w b / 2) / r with track b and wheel radius r."""

    def __init__(self, limits: Limits, wheels: Wheels, period: float) -> None:
        super().__init__(limits, period)
        self._wheels = wheels

    @property
    def wheel_speeds(self) -> tuple[float, ...]:
        """Of the left wheels, then of the right ones, rad/s."""
        wheels, sideways = self._wheels, self.angular * self._wheels.separation / 2.0
        left = (self.linear - sideways) / wheels.radius
        right = (self.linear + sideways) / wheels.radius
        return (left,) * len(wheels.left) + (right,) * len(wheels.right)

    def _approach(self, target: Twist) -> bool:
        return self._approach_freely(target)


class OmniController(WheelController):
    """Wheels that each push one way: all three velocities ramp on their own."""

    def __init__(self, limits: Limits, wheels: OmniWheels, period: float) -> None:
        super().__init__(limits, period)
        self._rows = [tuple(row) for row in (wheels.jacobian / wheels.radius).tolist()]

    @property
    def wheel_speeds(self) -> tuple[float, ...]:
        """Of each wheel, rad/s."""
        return tuple(
            x * self.linear + y * self.lateral + turn * self.angular for x, y, turn in self._rows
        )

    def _approach(self, target: Twist) -> bool:
        return self._approach_freely(target)


class AckermannController(WheelController):
    """Steered front wheels and driven rear wheels, kept to one centre of rotation.

    R. W. Ackermann's condition (1818): every wheel's axle points at the same point of the rear
    axle's line. With steering angle d in the middle of the front axle, wheelbase L and track b the
    curvature is k = tan d / L, the front wheels stand at atan(k L / (1 -+ k b / 2)) and the rear
    ones roll at v (1 -+ k b / 2). The speed ramps; the steering follows v and w at its own pace
    and, since tan d = w L / v says nothing at a standstill, stays as it is there: a car cannot
    turn in place.

    Attributes:
        angle: that the middle of the front axle is steered now, radians.
    """

    def __init__(self, limits: Limits, wheels: SteeredWheels, period: float) -> None:
        super().__init__(limits, period)
        self._wheels = wheels
        self._steer = wheels.steering_speed * period
        self.angle = self._wanted_angle = 0.0

    @property
    def wheel_speeds(self) -> tuple[float, ...]:
        """Of the left and the right rear wheel, rad/s."""
        sideways = self._curvature * self._wheels.track / 2.0
        rolling = self.linear / self._wheels.radius
        return rolling * (1.0 - sideways), rolling * (1.0 + sideways)

    @property
    def steering(self) -> tuple[float, ...]:
        """Of the left and the right front wheel, radians."""
        sideways = self._curvature * self._wheels.track / 2.0
        ahead = self._curvature * self._wheels.wheelbase
        return atan(ahead / (1.0 - sideways)), atan(ahead / (1.0 + sideways))

    @property
    def _curvature(self) -> float:
        return tan(self.angle) / self._wheels.wheelbase

    def _cut(self, twist: Twist) -> Twist:
        """No arc is tighter than the steering allows, and none is driven sideways."""
        cut = super()._cut(twist)
        most = abs(cut.linear) / self._wheels.turning_radius
        return Twist(cut.linear, min(max(cut.angular, -most), most))

    def _approach(self, target: Twist) -> bool:
        if target.linear != 0.0:
            wheels = self._wheels
            angle = atan(target.angular * wheels.wheelbase / target.linear)
            # Rounding may carry the tightest arc past the stop.
            self._wanted_angle = min(max(angle, -wheels.steering_angle), wheels.steering_angle)
        if self.linear == target.linear and self.angle == self._wanted_angle:
            return False
        self.linear = self._ramp(self.linear, target.linear)
        gap = self._wanted_angle - self.angle
        self.angle += min(max(gap, -self._steer), self._steer)
        if abs(gap) <= self._steer:
            self.angle = self._wanted_angle
        self.angular = self.linear * self._curvature
        return True


def wheel_controller_of(robot: RobotDescription, period: float) -> WheelController:
    """The controller for a robot's kind of wheels, advanced every `period` seconds."""
    wheels = robot.wheels
    if isinstance(wheels, Wheels):
        return DifferentialController(robot.limits, wheels, period)
    if isinstance(wheels, OmniWheels):
        return OmniController(robot.limits, wheels, period)
    return AckermannController(robot.limits, wheels, period)
