"""Objects that were detected in camera pictures."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import Literal, get_args

ObjectColour = Literal["red", "yellow", "green", "blue"]
OBJECT_COLOURS: tuple[str, ...] = get_args(ObjectColour)
"""Colours of objects that cameras are asked for."""


@dataclass(frozen=True, slots=True)
class Detection:
    """An object on the floor, as one picture shows it.

    Attributes:
        label: what it is, e.g. `red`.
        stamp: of the picture, seconds on the body's clock.
        position: (x, y) of its visible side, in the middle of its width, map frame, metres.
        deviation: standard deviation of the position along the line of sight, metres.
        width: metres across the line of sight; less than the object's if the picture cuts it.
        height: metres; likewise.
        box: left, top, right, bottom in the picture, pixels.
    """

    label: str
    stamp: float
    position: tuple[float, float]
    deviation: float
    width: float
    height: float
    box: tuple[int, int, int, int]

    def distance_to(self, x: float, y: float) -> float:
        """Metres from a point of the map frame."""
        return hypot(self.position[0] - x, self.position[1] - y)
