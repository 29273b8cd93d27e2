"""What zones round the robot make of a twist."""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, hypot, inf

import numpy as np

from stack.drivetrain.kinematics import moved, scaled
from stack.geometry.polygons import points_inside
from stack.safety.zones import SafetyZone
from stack.types import STANDSTILL, FloatArray, Footprint, Twist


class ZoneMonitor:
    """Looks which zones something is in, and slows or stops a twist as they say."""

    LOOK_AHEAD = 0.2
    """Seconds over which a twist is asked whether it leads away."""
    GAIN = 0.25
    """Share of what its rim travels that it has to gain in distance for that."""
    SLACK = 0.005

    def __init__(self, zones: Sequence[SafetyZone], footprint: Footprint) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._zones = [(zone, zone.outline(footprint)) for zone in zones]
        self._radius = footprint.circumscribed_radius
        self._footprint = np.ascontiguousarray(footprint.points, dtype=np.float64)

    def limited(self, twist: Twist, points: FloatArray) -> tuple[Twist, str]:
        """The same arc as fast as every zone allows, and why it is not faster.

        Args:
            twist: wanted, base frame.
            points: (m, 2) what stands around, base frame, metres.

        Returns:
            The twist, and words that are empty when no zone has a say.
        """
        share, reason = 1.0, ""
        speed = copysign(hypot(twist.linear, twist.lateral), twist.linear)
        for zone, outline in self._zones:
            if not zone.speed_from <= speed <= zone.speed_to:
                continue
            allowed = self._share(zone, outline, twist, points)
            if allowed < share:
                share, reason = allowed, _reason(zone, allowed)
        if share == 0.0:
            return STANDSTILL, reason
        if share == 1.0:
            return twist, ""
        return scaled(twist, share), reason

    def _share(
        self, zone: SafetyZone, outline: FloatArray, twist: Twist, points: FloatArray
    ) -> float:
        """The share of a twist's speed that one zone allows."""
        if zone.action == "approach":
            return min(1.0, self._time_to_contact(zone, outline, twist, points) / zone.time)
        if np.count_nonzero(points_inside(points, outline)) < zone.points:
            return 1.0
        if zone.action == "stop":
            return 1.0 if self._leads_away(outline, twist, points) else 0.0
        if zone.action == "slow_down":
            return zone.ratio
        speed, turn = hypot(twist.linear, twist.lateral), abs(twist.angular)
        return min(
            1.0,
            zone.linear / speed if speed else inf,
            zone.angular / turn if turn else inf,
        )

    def _time_to_contact(
        self, zone: SafetyZone, outline: FloatArray, twist: Twist, points: FloatArray
    ) -> float:
        radius = float(np.linalg.norm(outline, axis=1).max())
        time, _ = self._kernels.time_to_contact(
            points, outline, radius, 0.0, self.SLACK,
            twist.linear, twist.lateral, twist.angular, zone.time,
        )  # fmt: skip
        return float(time)

    def _leads_away(self, outline: FloatArray, twist: Twist, points: FloatArray) -> bool:
        """Whether driving on takes the robot away from everything in a zone."""
        inside = points_inside(points, outline)
        there = moved(twist, self.LOOK_AHEAD).inverse().transform(points[inside])
        now = self._kernels.nearest(points[inside], self._footprint)
        gain = self._kernels.nearest(there, self._footprint) - now
        rim = hypot(twist.linear, twist.lateral) + abs(twist.angular) * self._radius
        return bool(gain > 0.0 and gain >= self.GAIN * rim * self.LOOK_AHEAD)


def _reason(zone: SafetyZone, share: float) -> str:
    if share == 0.0:
        return f"stopped: something in the zone {zone.name!r}"
    return f"slower: something in the zone {zone.name!r}, {share:.0%} of the speed"
