"""Last walking direction of each tracked person: where one who stands before a robot will go."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stack.types import FloatArray, TrackedObject

WALKS = 0.3
"""m/s from which the velocity of a person shows where they want to go."""

AHEAD = 2.0
"""Metres for which people who stand are expected to go on straight."""


class WalkingDirections:
    """Remembers the direction of everybody in sight, also after they have stopped."""

    def __init__(self) -> None:
        self._known: dict[int, tuple[float, float]] = {}

    def update(self, people: Sequence[TrackedObject]) -> None:
        """Note how people walk now, map frame."""
        known = {person.id: self._known[person.id] for person in people if person.id in self._known}
        for person in people:
            if person.speed >= WALKS:
                x, y = person.velocity
                known[person.id] = (x / person.speed, y / person.speed)
        self._known = known

    def way_of(self, person: TrackedObject) -> FloatArray | None:
        """Return (2, 2) the way of a person straight ahead, map frame; None if it is not known."""
        direction = self._known.get(person.id)
        if direction is None:
            return None
        here = np.array(person.position)
        return np.array([here, here + AHEAD * np.array(direction)])
