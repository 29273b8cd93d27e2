"""Velocity smoother: limits speed and acceleration to those of the drive."""

from __future__ import annotations

from math import atan, copysign, hypot, tan

from stack.drivetrain.description import DriveKind, RobotDescription, SteeredWheels
from stack.drivetrain.kinematics import drivable, scaled, share_within_limits
from stack.types import STANDSTILL, Twist

STEERED_FROM = 1e-3
"""Speed in m/s from which a car's twist determines the steering angle."""


class VelocitySmoother:
    """Limits the change of commands in each control period.

    Forward speed and turning speed have separate limits. The velocity of an omnidirectional robot
    changes as a vector, so that its direction changes steadily. A car's turning speed follows from
    its speed and its steering angle, which has a limited rate.
    """

    def __init__(self, robot: RobotDescription, period: float) -> None:
        limits = robot.limits
        self._up = limits.linear_acceleration * period
        self._down = limits.linear_deceleration * period
        self._turn = limits.angular_acceleration * period
        self._is_omni, self._period = robot.drive is DriveKind.OMNI, period
        self._wheels = robot.wheels if isinstance(robot.wheels, SteeredWheels) else None
        self._steering = 0.0
        self._last = STANDSTILL

    @property
    def last(self) -> Twist:
        """The previous command, from which the next one is limited."""
        return self._last

    @last.setter
    def last(self, twist: Twist) -> None:
        self._last = twist
        if self._wheels is not None and abs(twist.linear) >= STEERED_FROM:
            self._steering = atan(self._wheels.wheelbase * twist.angular / twist.linear)

    def towards(self, wanted: Twist) -> Twist:
        """Return the reachable twist nearest to the wanted one; `last` does not change."""
        last = self.last
        linear = _towards(last.linear, wanted.linear, self._up, self._down)
        if self._wheels is not None:
            return Twist(linear, linear * self._curvature(wanted, self._wheels))
        angular = _towards(last.angular, wanted.angular, self._turn, self._turn)
        if self._is_omni:
            return Twist(*self._along(wanted, angular))
        return Twist(linear, angular, _towards(last.lateral, wanted.lateral, self._up, self._down))

    def _curvature(self, wanted: Twist, wheels: SteeredWheels) -> float:
        """Curvature of the arc with the steering angle one period later, 1/m."""
        steering = self._steering
        if abs(wanted.linear) >= STEERED_FROM:
            target = atan(wheels.wheelbase * wanted.angular / wanted.linear)
            most = wheels.steering_speed * self._period
            steering += max(-most, min(most, target - steering))
        return tan(steering) / wheels.wheelbase

    def _along(self, wanted: Twist, angular: float) -> tuple[float, float, float]:
        """One step along the straight line between two velocity vectors."""
        last = self.last
        ahead, left = wanted.linear - last.linear, wanted.lateral - last.lateral
        change = hypot(ahead, left)
        slows = hypot(wanted.linear, wanted.lateral) < hypot(last.linear, last.lateral)
        most = self._down if slows else self._up
        share = min(1.0, most / change) if change else 1.0
        if share == 1.0:
            return wanted.linear, angular, wanted.lateral
        return last.linear + share * ahead, angular, last.lateral + share * left


def _towards(last: float, wanted: float, up: float, down: float) -> float:
    """One step from last to wanted: at most `down` when braking, `up` when speeding up."""
    if last * wanted < 0.0:
        wanted = 0.0
    most = down if abs(wanted) < abs(last) else up
    return last + max(-most, min(most, wanted - last))


def within_limits(twist: Twist, robot: RobotDescription, top_speed: float) -> Twist:
    """Scale a twist to the robot's limits and the top speed (m/s); the arc stays the same.

    Arcs tighter than a car's turning radius are replaced by its tightest arc.
    """
    possible = drivable(twist, robot)
    share = share_within_limits(possible, robot.limits, top_speed)
    return possible if share == 1.0 else scaled(possible, share)


def beyond_dead_band(smooth: Twist, wanted: Twist, linear: float, angular: float) -> Twist:
    """Replace speeds inside the dead band of the drive.

    A speed inside the band becomes the edge of the band while the wanted speed is beyond it, and
    zero otherwise: the drive starts to move, and gets no command that it cannot follow.

    Args:
        smooth: smoothed velocity.
        wanted: target of the smoother.
        linear: edge of the band, m/s.
        angular: edge of the band, rad/s.
    """
    return Twist(
        _beyond(smooth.linear, wanted.linear, linear),
        _beyond(smooth.angular, wanted.angular, angular),
        _beyond(smooth.lateral, wanted.lateral, linear),
    )


def arc_beyond_dead_band(smooth: Twist, wanted: Twist, linear: float) -> Twist:
    """As `beyond_dead_band` for a car, on the same arc: a car turns only while it drives."""
    speed = _beyond(smooth.linear, wanted.linear, linear)
    return scaled(smooth, speed / smooth.linear) if smooth.linear else STANDSTILL


def _beyond(smooth: float, wanted: float, band: float) -> float:
    if abs(smooth) >= band:
        return smooth
    return copysign(band, smooth) if smooth * wanted > 0.0 and abs(wanted) >= band else 0.0
