"""Safety zones: polygons around the robot that stop or slow it when an obstacle is inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import copysign, hypot, inf
from typing import Any

import numpy as np

from stack.drivetrain.kinematics import moved, scaled
from stack.errors import ParameterError
from stack.geometry.polygons import points_inside
from stack.parameters import Declaration, build, parameter
from stack.safety.parameters import PADDING_SLACK
from stack.types import STANDSTILL, FloatArray, Footprint, Limitation, Twist
from stack.types.limitations import SLOWER, STOPPED, ZONE

ACTIONS = ("stop", "slow_down", "limit", "approach")
_METRES = Declaration("corners", float, unit="m")


@dataclass(frozen=True)
class SafetyZone:
    """A polygon or circle around the robot and the action while an obstacle is inside.

    Without corners and radius the zone is the footprint. Actions follow Nav2's collision monitor:
    `stop` allows only motion away from the obstacle, `slow_down` scales the speed by `ratio`,
    `limit` caps linear and angular speed, `approach` slows down so that the outline touches
    nothing within `time`.
    """

    action: str = parameter("stop", one_of=ACTIONS, help="action while an obstacle is inside")
    name: str = parameter("", help="name for messages; default: the action")
    corners: tuple[Any, ...] = parameter((), help="at least three [x, y] in metres, base frame")
    radius: float = parameter(
        0.0, "m", at_least=0.0, help="radius of a circle around the base, instead of corners"
    )
    points: int = parameter(4, at_least=1, help="scan points inside that count as an obstacle")
    ratio: float = parameter(0.5, at_least=0.0, at_most=1.0, help="slow_down: factor for the speed")
    linear: float = parameter(0.5, "m/s", at_least=0.0, help="limit: top speed")
    angular: float = parameter(0.5, "rad/s", at_least=0.0, help="limit: top turning speed")
    time: float = parameter(2.0, "s", above=0.0, at_most=10.0, help="approach: time to contact")
    speed_from: float = parameter(
        -inf, "m/s", help="active only at or above this forward speed; backward is negative"
    )
    speed_to: float = parameter(inf, "m/s", help="active only at or below this forward speed")

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", tuple(map(self._corner, self.corners)))
        if self.corners and (len(self.corners) < 3 or self.radius):
            raise ParameterError(
                "corners", f"{len(self.corners)} corners and radius {self.radius:g} m, expected at "
                "least three corners, or a radius, or neither",
            )  # fmt: skip
        if self.speed_from > self.speed_to:
            raise ParameterError(
                "speed_from", f"{self.speed_from:g} m/s is above speed_to {self.speed_to:g} m/s"
            )
        object.__setattr__(self, "name", self.name or self.action)

    def outline(self, footprint: Footprint) -> FloatArray:
        """Return (n, 2) corners in the base frame, metres; a circle becomes a 16-gon around it."""
        if self.corners:
            return np.array(self.corners, dtype=np.float64)
        outline = Footprint.circle(self.radius) if self.radius else footprint
        return np.ascontiguousarray(outline.points, dtype=np.float64)

    @staticmethod
    def _corner(raw: Any) -> tuple[float, float]:
        if not isinstance(raw, list | tuple) or len(raw) != 2:
            raise ParameterError("corners", f"a corner is [x, y] in metres, got {raw!r}")
        return _METRES.read(raw[0]), _METRES.read(raw[1])


def read_safety_zones(raw: Any, parameters: Any = None) -> tuple[SafetyZone, ...]:
    """Read safety zones from a mission or robot file.

    Raises:
        ParameterError: a zone is wrong; the parameter named is `zones`.
    """
    if not isinstance(raw, Sequence) or isinstance(raw, str):
        raise ParameterError("zones", f"expected a list of zones, got {raw!r}")
    zones = []
    for number, item in enumerate(raw, start=1):
        if not isinstance(item, Mapping):
            raise ParameterError("zones", f"zone {number}: expected a mapping, got {item!r}")
        try:
            zones.append(build(SafetyZone, item))
        except ParameterError as error:
            raise ParameterError("zones", f"zone {number}: {error}", error.hint) from None
    return tuple(zones)


class ZoneMonitor:
    """Checks which zones contain points, and limits or stops a twist as they require."""

    LOOK_AHEAD = 0.2
    """Seconds over which the motion away from points in a zone is checked."""
    GAIN = 0.25
    """Required increase of the distance, as a share of the distance that the rim travels."""

    def __init__(self, zones: Sequence[SafetyZone], footprint: Footprint) -> None:
        from stack.safety import kernels

        self._kernels = kernels
        self._zones = [(zone, zone.outline(footprint)) for zone in zones]
        self._radius = footprint.circumscribed_radius
        self._footprint = np.ascontiguousarray(footprint.points, dtype=np.float64)

    def limited(self, twist: Twist, points: FloatArray) -> tuple[Twist, Limitation | None]:
        """Scale a twist to the speed that every zone allows.

        Args:
            twist: commanded velocity, base frame.
            points: (m, 2) obstacle points, base frame, metres.

        Returns:
            The twist, and why it is limited; None when no zone applies.
        """
        share, limitation = 1.0, None
        speed = copysign(hypot(twist.linear, twist.lateral), twist.linear)
        for zone, outline in self._zones:
            if not zone.speed_from <= speed <= zone.speed_to:
                continue
            allowed = self._share(zone, outline, twist, points)
            if allowed < share:
                share, limitation = allowed, _limitation(zone, allowed)
        if share == 0.0:
            return STANDSTILL, limitation
        if share == 1.0:
            return twist, None
        return scaled(twist, share), limitation

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
            points, outline, radius, 0.0, PADDING_SLACK,
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


def _limitation(zone: SafetyZone, share: float) -> Limitation:
    what = f"obstacle in the zone {zone.name!r}"
    if share == 0.0:
        return Limitation(STOPPED, ZONE, what)
    return Limitation(SLOWER, ZONE, f"{what}, {share:.0%} of the speed")
