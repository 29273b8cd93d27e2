"""Wheel controllers: velocity commands to wheel speeds, with limits, ramps and dead-man stop."""

from __future__ import annotations

from abc import ABC, abstractmethod
from math import atan, tan

from stack.body import DEAD_MAN
from stack.drivetrain.description import Limits, OmniWheels, RobotDescription, SteeredWheels, Wheels
from stack.types import STANDSTILL, Twist


class WheelController(ABC):
    """Base class of the wheel controllers; advanced once per physics step.

    Attributes:
        linear: current setpoint of the forward velocity, m/s.
        lateral: current setpoint of the velocity to the left, m/s.
        angular: current setpoint of the turning speed, rad/s.
    """

    def __init__(self, limits: Limits, period: float) -> None:
        self._limits = limits
        self._up = limits.linear_acceleration * period
        self._down = limits.linear_deceleration * period
        self._turn = limits.angular_acceleration * period
        self._dead_man_steps = round(DEAD_MAN / period)
        self._target = STANDSTILL
        self._steps_since_command = self._dead_man_steps
        self.linear = self.lateral = self.angular = 0.0

    def command(self, twist: Twist) -> None:
        """Set the target velocity, limited to what the drive can do."""
        self._target = self._limited(twist)
        self._steps_since_command = 0

    def halt(self) -> None:
        """Reset target and setpoint to zero without a ramp, after the robot was lifted."""
        self._target = STANDSTILL
        self.linear = self.lateral = self.angular = 0.0

    def advance(self) -> bool:
        """Advance by one physics step; return whether wheel speeds or steering changed."""
        self._steps_since_command += 1
        alive = self._steps_since_command <= self._dead_man_steps
        return self._approach(self._target if alive else STANDSTILL)

    @property
    @abstractmethod
    def wheel_speeds(self) -> tuple[float, ...]:
        """Speed of each driven wheel, rad/s, in the order of the description."""

    @property
    def steering(self) -> tuple[float, ...]:
        """Angles of the steered wheels, left and right, radians; empty without steering."""
        return ()

    @abstractmethod
    def _approach(self, target: Twist) -> bool:
        """Move the setpoint one physics step towards a velocity; return whether it changed."""

    def _limited(self, twist: Twist) -> Twist:
        limits = self._limits
        return Twist(
            min(max(twist.linear, -limits.reverse_speed), limits.linear_speed),
            min(max(twist.angular, -limits.angular_speed), limits.angular_speed),
            min(max(twist.lateral, -limits.lateral_speed), limits.lateral_speed),
        )

    def _ramp(self, now: float, target: float) -> float:
        """Return the speed after one physics step on the ramp from `now` to `target`, m/s."""
        slowing = now * target < 0.0 or abs(target) < abs(now)
        step = self._down if slowing else self._up
        if slowing and now * target < 0.0:
            target = 0.0  # decelerate to zero first, then accelerate in the other direction
        if abs(target - now) <= step:
            return target
        return now + (step if target > now else -step)

    def _ramp_each(self, target: Twist) -> bool:
        """Ramp the three velocities independently, each at its acceleration limit."""
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
    """Differential drive: wheel speed (v -+ w b / 2) / r with track b and wheel radius r."""

    def __init__(self, limits: Limits, wheels: Wheels, period: float) -> None:
        super().__init__(limits, period)
        self._wheels = wheels

    @property
    def wheel_speeds(self) -> tuple[float, ...]:
        """Speeds of the left wheels, then of the right wheels, rad/s."""
        wheels, sideways = self._wheels, self.angular * self._wheels.separation / 2.0
        left = (self.linear - sideways) / wheels.radius
        right = (self.linear + sideways) / wheels.radius
        return (left,) * len(wheels.left) + (right,) * len(wheels.right)

    def _approach(self, target: Twist) -> bool:
        return self._ramp_each(target)


class OmniController(WheelController):
    """Omnidirectional wheels: the three velocities ramp independently."""

    def __init__(self, limits: Limits, wheels: OmniWheels, period: float) -> None:
        super().__init__(limits, period)
        self._rows = [tuple(row) for row in (wheels.jacobian / wheels.radius).tolist()]

    @property
    def wheel_speeds(self) -> tuple[float, ...]:
        """Speed of each wheel, rad/s."""
        return tuple(
            x * self.linear + y * self.lateral + turn * self.angular for x, y, turn in self._rows
        )

    def _approach(self, target: Twist) -> bool:
        return self._ramp_each(target)


class AckermannController(WheelController):
    """Steered front wheels and driven rear wheels with one common centre of rotation.

    R. W. Ackermann's condition (1818): the axles of all wheels intersect in one point on the line
    of the rear axle. With steering angle d at the middle of the front axle, wheelbase L and track
    b, the curvature is k = tan d / L, the front wheels are steered by atan(k L / (1 -+ k b / 2))
    and the rear wheels roll at v (1 -+ k b / 2). The speed ramps at the acceleration limits and
    the steering angle at the steering speed. At v = 0, tan d = w L / v is undefined and the
    steering angle is kept: a car cannot turn in place.

    Attributes:
        angle: current steering angle at the middle of the front axle, radians.
    """

    def __init__(self, limits: Limits, wheels: SteeredWheels, period: float) -> None:
        super().__init__(limits, period)
        self._wheels = wheels
        self._steer = wheels.steering_speed * period
        self.angle = self._target_angle = 0.0

    @property
    def wheel_speeds(self) -> tuple[float, ...]:
        """Speeds of the left and the right rear wheel, rad/s."""
        sideways = self._curvature * self._wheels.track / 2.0
        rolling = self.linear / self._wheels.radius
        return rolling * (1.0 - sideways), rolling * (1.0 + sideways)

    @property
    def steering(self) -> tuple[float, ...]:
        """Angles of the left and the right front wheel, radians."""
        sideways = self._curvature * self._wheels.track / 2.0
        ahead = self._curvature * self._wheels.wheelbase
        return atan(ahead / (1.0 - sideways)), atan(ahead / (1.0 + sideways))

    @property
    def _curvature(self) -> float:
        return tan(self.angle) / self._wheels.wheelbase

    def _limited(self, twist: Twist) -> Twist:
        """Limit the curvature to the turning radius and drop the lateral velocity."""
        limited = super()._limited(twist)
        most = abs(limited.linear) / self._wheels.turning_radius
        return Twist(limited.linear, min(max(limited.angular, -most), most))

    def _approach(self, target: Twist) -> bool:
        if target.linear != 0.0:
            wheels = self._wheels
            angle = atan(target.angular * wheels.wheelbase / target.linear)
            # Rounding may put the angle of the tightest arc above the limit.
            self._target_angle = min(max(angle, -wheels.steering_angle), wheels.steering_angle)
        if self.linear == target.linear and self.angle == self._target_angle:
            return False
        self.linear = self._ramp(self.linear, target.linear)
        gap = self._target_angle - self.angle
        self.angle += min(max(gap, -self._steer), self._steer)
        if abs(gap) <= self._steer:
            self.angle = self._target_angle
        self.angular = self.linear * self._curvature
        return True


def wheel_controller_of(robot: RobotDescription, period: float) -> WheelController:
    """Return the controller for the robot's drive, advanced every `period` seconds."""
    wheels = robot.wheels
    if isinstance(wheels, Wheels):
        return DifferentialController(robot.limits, wheels, period)
    if isinstance(wheels, OmniWheels):
        return OmniController(robot.limits, wheels, period)
    return AckermannController(robot.limits, wheels, period)
