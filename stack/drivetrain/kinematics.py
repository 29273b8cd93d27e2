"""Arithmetic with twists: scaling to speed limits, and the motion by a constant twist."""

from __future__ import annotations

from math import cos, hypot, inf, pi, sin

import numpy as np

from stack.drivetrain.limits import Limits
from stack.types import FloatArray, Pose2D, Twist


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


def poses_along(start: Pose2D, twist: Twist, times: FloatArray) -> FloatArray:
    """(n, 3) x, y, heading after each of n times, seconds, at a constant twist; as `moved`.

    Args:
        start: start pose in any fixed frame, which is also that of the result.
        twist: in the robot's frame.
        times: (n,), seconds.
    """
    half = 0.5 * twist.angular * times
    chord = times * np.sinc(half / pi)
    c, s = np.cos(start.heading + half), np.sin(start.heading + half)
    poses = np.empty((len(times), 3))  # a third of the time of column_stack
    poses[:, 0] = start.x + chord * (c * twist.linear - s * twist.lateral)
    poses[:, 1] = start.y + chord * (s * twist.linear + c * twist.lateral)
    poses[:, 2] = start.heading + 2.0 * half
    return poses


def swept_poses(
    start: Pose2D, twist: Twist, amount: float, radius: float, spacing: float
) -> tuple[FloatArray, FloatArray]:
    """Poses along a constant twist, so dense that they represent the area that an outline sweeps.

    Args:
        start: start pose in any fixed frame.
        twist: per unit of `amount`.
        amount: seconds, or metres or radians for a twist per metre or radian.
        radius: circumscribed radius of the outline, metres.
        spacing: maximum motion of any point of the outline between two poses, metres.

    Returns:
        (k,) amounts after the start, and (k, 3) poses x, y, heading.
    """
    rim = hypot(twist.linear, twist.lateral) + abs(twist.angular) * radius
    count = max(1, int(np.ceil(amount * rim / spacing)))
    amounts = np.linspace(0.0, amount, count + 1)[1:]
    return amounts, poses_along(start, twist, amounts)
