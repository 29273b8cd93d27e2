"""Safety zones: polygons around the robot that stop or slow it when an obstacle is inside."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import numpy as np

from stack.errors import ParameterError
from stack.parameters import Declaration, build, parameter
from stack.types import FloatArray, Footprint

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


def read_zones(raw: Any, parameters: Any = None) -> tuple[SafetyZone, ...]:
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
