"""A declared fault: which kind, with which numbers, when and for how long. Data only."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any


@dataclass(frozen=True)
class PlannedFault:
    """A fault that a mission, a world or a file declares.

    Attributes:
        name: of the kind, with a number if there are several of it: `push`, `push_2`.
        kind: name of the kind.
        parameters: of the kind, its `Parameters`.
        time: seconds of the simulation from which it may begin.
        near: (x, y, radius) metres: it begins when the true position is in this circle; None:
            anywhere.
        per_minute: probability that it begins within a minute, again and again; 0: it begins once.
        duration: seconds; inf: to the end.
    """

    name: str
    kind: str
    parameters: Any
    time: float = 0.0
    near: tuple[float, float, float] | None = None
    per_minute: float = 0.0
    duration: float = inf
