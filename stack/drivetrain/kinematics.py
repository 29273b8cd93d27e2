"""Arithmetic with twists: scaling to speed limits and the displacement by a constant twist."""

from __future__ import annotations

from math import cos, hypot, inf, sin

from stack.drivetrain.limits import Limits
from stack.types import Pose2D, Twist


def share_within_limits(twist: Twist, limits: Limits, top_speed: float = inf) -> float:
    """The largest factor, at most 1, with which a twist is within the speed limits.

    Scaling all components by one factor keeps the arc. Limits apply to the forward or reverse
    speed, the lateral speed, the speed over ground and the turning speed.

    Args:
        twist: base frame.
        limits: of the robot.
        top_speed: limit of the speed over ground, m/s.
    """
    forward = min(limits.linear_speed if twist.linear >= 0.0 else limits.reverse_speed, top_speed)
    speed, sideways = hypot(twist.linear, twist.lateral), abs(twist.lateral)
    share = 1.0
    if twist.lateral:
        top = min(max(forward, limits.lateral_speed), top_speed)
        share = min(1.0, top / speed, limits.lateral_speed / sideways)
    if abs(twist.linear) * share > forward:
        share = forward / abs(twist.linear)
    if abs(twist.angular) * share > limits.angular_speed:
        share = limits.angular_speed / abs(twist.angular)
    return share


def scaled(twist: Twist, share: float) -> Twist:
    """Scale all components of a twist; the arc stays the same."""
    return Twist(twist.linear * share, twist.angular * share, twist.lateral * share)


def speed_towards(direction: float, limits: Limits) -> float:
    """Maximum speed of an omnidirectional robot in a direction (radians, base frame), m/s."""
    c, s = cos(direction), abs(sin(direction))
    forward = limits.linear_speed if c >= 0.0 else limits.reverse_speed
    along = forward / abs(c) if abs(c) > 1e-9 else inf
    across = limits.lateral_speed / s if s > 1e-9 else inf
    return min(along, across, max(forward, limits.lateral_speed))


def moved(twist: Twist, seconds: float) -> Pose2D:
    """Displacement by a constant twist in some seconds, in the frame of the start."""
    half = 0.5 * twist.angular * seconds
    chord = seconds if abs(half) < 1e-9 else seconds * sin(half) / half
    c, s = cos(half), sin(half)
    return Pose2D(
        chord * (c * twist.linear - s * twist.lateral),
        chord * (s * twist.linear + c * twist.lateral),
        2.0 * half,
    )
