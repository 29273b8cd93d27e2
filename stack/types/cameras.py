"""State of a camera, for displays and reports."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf


@dataclass(frozen=True, slots=True)
class CameraState:
    """State of a camera.

    Attributes:
        name: of the sensor.
        is_on: whether pictures are requested.
        age: seconds since its newest usable picture; inf before the first.
        fault: size | type | stamp | late | invalid | uniform | frozen | silent; empty if none.
    """

    name: str
    is_on: bool = False
    age: float = inf
    fault: str = ""
