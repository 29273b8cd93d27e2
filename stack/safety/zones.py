"""Zones round the robot that change how it may drive when something is in them."""

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
    """A polygon or circle round the robot, and what happens while something is in it.

    Without corners and radius it is the footprint. Names and meanings follow Nav2's collision
    monitor: `stop` lets the robot only drive away from what is there, `slow_down` drives at a share
    of the speed, `limit` no faster than two limits, `approach` so that the outline, driven on,
    reaches nothing sooner than `time`.
    """

    action: str = parameter("stop", one_of=ACTIONS, help="what happens")
    name: str = parameter("", help="what it is called; its action unless it has a name")
    corners: tuple[Any, ...] = parameter((), help="at least three [x, y] in metres, base frame")
    radius: float = parameter(0.0, "m", at_least=0.0, help="of a circle round the base instead")
    points: int = parameter(4, at_least=1, help="this many scan points inside count as something")
    ratio: float = parameter(0.5, at_least=0.0, at_most=1.0, help="slow_down: share of the speed")
    linear: float = parameter(0.5, "m/s", above=0.0, help="limit: top speed")
    angular: float = parameter(0.5, "rad/s", above=0.0, help="limit: top turning speed")
    time: float = parameter(2.0, "s", above=0.0, at_most=10.0, help="approach: time to contact")
    speed_from: float = parameter(
        -inf, "m/s", help="in force only while driving at least this fast; backward is negative"
    )
    speed_to: float = parameter(inf, "m/s", help="in force only while driving at most this fast")

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
        """(n, 2) corners in the base frame, metres; a circle is a 16-gon round it."""
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
    """Zones as they stand in a mission or robot file.

    Raises:
        ParameterError: one will not do; named `zones`.
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
