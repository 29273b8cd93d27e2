"""Zone monitor: limits a twist when points are inside safety zones around the robot."""

from __future__ import annotations

from collections.abc import Sequence
from math import copysign, hypot, inf

import numpy as np

from stack.drivetrain.kinematics import moved, scaled
from stack.geometry.polygons import points_inside
from stack.safety.zones import SafetyZone
from stack.types import STANDSTILL, FloatArray, Footprint, Twist


class ZoneMonitor:
    """Checks which zones contain points, and limits or stops a twist as they require."""

    LOOK_AHEAD = 0.2
    """Seconds over which the motion away from points in a zone is checked."""
    GAIN = 0.25
    """Required increase of the distance, as a share of the distance that the rim travels."""
    SLACK = 0.005

    def __init__(self, zones: Sequence[SafetyZone], footprint: Footprint) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._zones = [(zone, zone.outline(footprint)) for zone in zones]
        self._radius = footprint.circumscribed_radius
        self._footprint = np.ascontiguousarray(footprint.points, dtype=np.float64)

    def limited(self, twist: Twist, points: FloatArray) -> tuple[Twist, str]:
        """Scale a twist to the speed that every zone allows.

        Args:
            twist: commanded velocity, base frame.
            points: (m, 2) obstacle points, base frame, metres.

        Returns:
            The twist, and the reason of the limit; empty when no zone applies.
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
        """Share of a twist's speed that one zone allows."""
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
        """Whether the twist leads away from all points in a zone."""
        inside = points_inside(points, outline)
        there = moved(twist, self.LOOK_AHEAD).inverse().transform(points[inside])
        now = self._kernels.nearest(points[inside], self._footprint)
        gain = self._kernels.nearest(there, self._footprint) - now
        rim = hypot(twist.linear, twist.lateral) + abs(twist.angular) * self._radius
        return bool(gain > 0.0 and gain >= self.GAIN * rim * self.LOOK_AHEAD)


def _reason(zone: SafetyZone, share: float) -> str:
    if share == 0.0:
        return f"stopped: obstacle in the zone {zone.name!r}"
    return f"slower: obstacle in the zone {zone.name!r}, {share:.0%} of the speed"
