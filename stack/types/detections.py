"""Objects that were detected in camera pictures."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray

ObjectColour = Literal["red", "yellow", "green", "blue"]
OBJECT_COLOURS: tuple[str, ...] = get_args(ObjectColour)
"""Colours of objects that cameras are asked for."""

PERSON = "person"
"""Label of people, of detections and of tracks."""


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
        score: certainty in [0, 1]; 1 for detectors that state none.
    """

    label: str
    stamp: float
    position: tuple[float, float]
    deviation: float
    width: float
    height: float
    box: tuple[int, int, int, int]
    score: float = 1.0

    def distance_to(self, x: float, y: float) -> float:
        """Metres from a point of the map frame."""
        return hypot(self.position[0] - x, self.position[1] - y)


@dataclass(frozen=True, slots=True)
class ColourMask:
    """Pixels of a picture that have a colour.

    Attributes:
        label: the colour.
        stamp: of the picture, seconds on the body's clock.
        pixels: (height, width) uint8, 1 or 0.
    """

    label: str
    stamp: float
    pixels: NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class SeenObjects:
    """What the object detector has found.

    Attributes:
        detections: of the newest picture, the nearest first; None if there is no new one.
        people: ids of the tracks that are people.
    """

    detections: tuple[Detection, ...] | None = None
    people: frozenset[int] = frozenset()


NO_OBJECTS = SeenObjects()
