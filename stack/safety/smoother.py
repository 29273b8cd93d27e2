"""Velocity smoother and speed limit: what the drive can follow."""

from __future__ import annotations

from math import atan, copysign, hypot, tan

from stack.drivetrain.description import DriveKind, RobotDescription, SteeredWheels
from stack.drivetrain.kinematics import drivable, scaled, share_within_limits
from stack.types import STANDSTILL, Twist

STEERED_FROM = 1e-3
"""m/s from which a car's twist says how its wheels are steered."""


class VelocitySmoother:
    """Limits how fast commands change, one control period at a time.

    Forward speed and turning speed each have their ramp. The velocity of an omnidirectional robot
    changes as a vector, so that its direction does not swerve. A car's turning speed follows from
    its speed and from the angle of its wheels, which turn no faster than they can.
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
        """The command from which the next one departs."""
        return self._last

    @last.setter
    def last(self, twist: Twist) -> None:
        self._last = twist
        if self._wheels is not None and abs(twist.linear) >= STEERED_FROM:
            self._steering = atan(self._wheels.wheelbase * twist.angular / twist.linear)

    def towards(self, wanted: Twist) -> Twist:
        """The reachable twist that is nearest to the wanted one; does not yet move there."""
        last = self.last
        linear = _towards(last.linear, wanted.linear, self._up, self._down)
        if self._wheels is not None:
            return Twist(linear, linear * self._curvature(wanted, self._wheels))
        angular = _towards(last.angular, wanted.angular, self._turn, self._turn)
        if self._is_omni:
            return Twist(*self._along(wanted, angular))
        return Twist(linear, angular, _towards(last.lateral, wanted.lateral, self._up, self._down))

    def _curvature(self, wanted: Twist, wheels: SteeredWheels) -> float:
        """Of the arc on which the wheels are steered one period later, 1/m."""
        steering = self._steering
        if abs(wanted.linear) >= STEERED_FROM:
            aim = atan(wheels.wheelbase * wanted.angular / wanted.linear)
            most = wheels.steering_speed * self._period
            steering += max(-most, min(most, aim - steering))
        return tan(steering) / wheels.wheelbase

    def _along(self, wanted: Twist, angular: float) -> tuple[float, float, float]:
        """One step on the straight line between two velocities over ground."""
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
    """One step from last to wanted: braking at most `down`, speeding up at most `up`."""
    if last * wanted < 0.0:
        wanted = 0.0
    most = down if abs(wanted) < abs(last) else up
    return last + max(-most, min(most, wanted - last))


def within_limits(twist: Twist, robot: RobotDescription, top_speed: float) -> Twist:
    """The same arc, driven no faster than the robot and the top speed (m/s) allow.

    Arcs tighter than a car steers become the tightest that it can.
    """
    possible = drivable(twist, robot)
    share = share_within_limits(possible, robot.limits, top_speed)
    return possible if share == 1.0 else scaled(possible, share)


def beyond_dead_band(smooth: Twist, wanted: Twist, linear: float, angular: float) -> Twist:
    """What a drive that cannot move slower than its dead band is to be told.

    A speed inside the band becomes the band's edge on the way up to a wanted one beyond it, else
    zero: so a drive gets going, and does not hum where it stands.

    Args:
        smooth: what the smoother allows now.
        wanted: where it is heading.
        linear: edge of the band, m/s.
        angular: likewise, rad/s.
    """
    return Twist(
        _beyond(smooth.linear, wanted.linear, linear),
        _beyond(smooth.angular, wanted.angular, angular),
        _beyond(smooth.lateral, wanted.lateral, linear),
    )


def arc_beyond_dead_band(smooth: Twist, wanted: Twist, linear: float) -> Twist:
    """The same for a car: on the same arc, as it does not turn but by driving."""
    speed = _beyond(smooth.linear, wanted.linear, linear)
    return scaled(smooth, speed / smooth.linear) if smooth.linear else STANDSTILL


def _beyond(smooth: float, wanted: float, band: float) -> float:
    if abs(smooth) >= band:
        return smooth
    return copysign(band, smooth) if smooth * wanted > 0.0 and abs(wanted) >= band else 0.0
