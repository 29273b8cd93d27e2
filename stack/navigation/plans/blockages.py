"""Remembered blockages, so that the robot does not drive back and forth between two routes.

A gap is blocked when seen from near. When the robot has driven away, the obstacle expires from the
costmap and the path through the gap looks better again. A remembered blockage rejects such paths
for a while. The time doubles each time the gap is found blocked again.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stack.types import FloatArray


@dataclass(frozen=True, slots=True)
class Blockage:
    """A blocked position (map frame, metres), remembered for `hold` seconds, until time `until`."""

    x: float
    y: float
    hold: float
    until: float


class Blockages:
    """Blockages found during one drive.

    Args:
        radius: metres within which two blockages are the same and a path leads through one.
        first_hold: seconds for which a new blockage is remembered.
    """

    def __init__(self, radius: float, first_hold: float) -> None:
        self._radius, self._first_hold = radius, first_hold
        self._known: list[Blockage] = []

    def note(self, place: tuple[float, float], time: float) -> None:
        """Remember that the path is blocked at a position (x, y), map frame, metres."""
        x, y = place
        for i, known in enumerate(self._known):
            if np.hypot(known.x - x, known.y - y) <= self._radius:
                hold = 2.0 * known.hold if time > known.until else known.hold
                self._known[i] = replace(known, hold=hold, until=time + hold)
                return
        self._known.append(Blockage(x, y, self._first_hold, time + self._first_hold))

    def bar(self, points: FloatArray, time: float) -> bool:
        """Whether a path (n, 2) leads through a blockage that is still remembered."""
        return any(
            bool((np.hypot(points[:, 0] - b.x, points[:, 1] - b.y) <= self._radius).any())
            for b in self._known
            if time < b.until
        )
