"""Places where the way was blocked, remembered so that a robot does not pace to and fro.

Seen from near, a gap is blocked; from afar what blocked it has faded from the costmap, and the way
through looks better again. A remembered blockage keeps better-looking paths away from it for a
while, and twice as long each time it proves true again: turning back happens ever more seldom.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stack.types import FloatArray

NEAR = 0.6
"""Metres within which two blockages are one, and a path leads through it."""

FIRST_HOLD = 10.0
"""Seconds for which a blockage is believed when met for the first time."""


@dataclass(frozen=True, slots=True)
class Blockage:
    """A place that was blocked (map frame, metres), believed for `hold` seconds, to `until`."""

    x: float
    y: float
    hold: float
    until: float


class Blockages:
    """The blockages one drive has met."""

    def __init__(self) -> None:
        self._known: list[Blockage] = []

    def note(self, place: tuple[float, float], time: float) -> None:
        """The way was given up because it is blocked at a place (x, y)."""
        x, y = place
        for i, known in enumerate(self._known):
            if np.hypot(known.x - x, known.y - y) <= NEAR:
                hold = 2.0 * known.hold if time > known.until else known.hold
                self._known[i] = replace(known, hold=hold, until=time + hold)
                return
        self._known.append(Blockage(x, y, FIRST_HOLD, time + FIRST_HOLD))

    def bar(self, points: FloatArray, time: float) -> bool:
        """Whether a way (n, 2) leads through a blockage that is still believed."""
        return any(
            bool((np.hypot(points[:, 0] - b.x, points[:, 1] - b.y) <= NEAR).any())
            for b in self._known
            if time < b.until
        )
