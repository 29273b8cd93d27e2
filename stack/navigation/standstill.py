"""When a robot counts as standing."""

from __future__ import annotations

from math import hypot

from stack.types import Twist

STANDING_SPEED, STANDING_TURN = 0.02, 0.05
"""Speeds in m/s and rad/s below which the robot counts as standing."""


def standing(twist: Twist) -> bool:
    """Whether a measured velocity counts as standstill."""
    speed = hypot(twist.linear, twist.lateral)
    return speed < STANDING_SPEED and abs(twist.angular) < STANDING_TURN
