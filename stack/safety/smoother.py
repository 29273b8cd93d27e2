"""Velocity smoother and speed limit: what the drive can follow."""

from __future__ import annotations

from math import copysign, hypot

from stack.description import Limits
from stack.types import STANDSTILL, Twist


class VelocitySmoother:
    """Limits how fast commands change, one control period at a time."""

    def __init__(self, limits: Limits, period: float) -> None:
        self._up = limits.linear_acceleration * period
        self._down = limits.linear_deceleration * period
        self._turn = limits.angular_acceleration * period
        self.last = STANDSTILL

    def towards(self, wanted: Twist) -> Twist:
        """The reachable twist that is nearest to the wanted one; does not yet move there."""
        last = self.last
        return Twist(
            _towards(last.linear, wanted.linear, self._up, self._down),
            _towards(last.angular, wanted.angular, self._turn, self._turn),
            _towards(last.lateral, wanted.lateral, self._up, self._down),
        )


def _towards(last: float, wanted: float, up: float, down: float) -> float:
    """One step from last to wanted: braking at most `down`, speeding up at most `up`."""
    if last * wanted < 0.0:
        wanted = 0.0
    most = down if abs(wanted) < abs(last) else up
    return last + max(-most, min(most, wanted - last))


def within_limits(twist: Twist, limits: Limits, top_speed: float) -> Twist:
    """The same arc, driven no faster than the limits and the top speed (m/s) allow."""
    forward = min(limits.linear_speed if twist.linear >= 0.0 else limits.reverse_speed, top_speed)
    speed = hypot(twist.linear, twist.lateral)
    share = 1.0
    if speed > forward:
        share = forward / speed
    if abs(twist.angular) * share > limits.angular_speed:
        share = limits.angular_speed / abs(twist.angular)
    if share == 1.0:
        return twist
    return Twist(twist.linear * share, twist.angular * share, twist.lateral * share)


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


def _beyond(smooth: float, wanted: float, band: float) -> float:
    if abs(smooth) >= band:
        return smooth
    return copysign(band, smooth) if smooth * wanted > 0.0 and abs(wanted) >= band else 0.0
