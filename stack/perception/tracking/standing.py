"""Memory of the places where something stands, also out of sight.

A track ends a second after its object was seen last. What stands is still there when the robot
comes back: an object that appears where something has stood before is that thing, and nobody who
has come there.
"""

from __future__ import annotations

import numpy as np

from stack.perception.tracking.clusters import beams_towards
from stack.perception.tracking.view import BEHIND, View
from stack.types import FloatArray

SAME_PLACE = 0.3
"""Metres between the centres of two views of what stands: errors of a partly seen circle, and of
the pose."""

SEEN_THROUGH = 2
"""Scans in a row that see through a place after which nothing stands there."""


class StandingPlaces:
    """Places where something that has not moved was seen, until scans see through them."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Forget all places."""
        self._rows: FloatArray = np.empty((0, 5))  # x, y, radius, since, scans that saw through

    def __len__(self) -> int:
        return len(self._rows)

    def note(self, found: FloatArray, time: float) -> None:
        """Remember what stands; a place keeps the time at which it was noted first.

        Args:
            found: (n, 3) centres x, y in the map frame and radii, metres.
            time: seconds.
        """
        if not len(found):
            return
        known = np.zeros(len(found), dtype=np.bool_)
        if len(self._rows):
            off = found[:, None, :2] - self._rows[:, :2]
            away = np.hypot(off[..., 0], off[..., 1])
            nearest = away.argmin(axis=1)
            known = away[np.arange(len(found)), nearest] <= SAME_PLACE
            self._rows[nearest[known], :3] = found[known]
            self._rows[nearest[known], 4] = 0.0
        new = found[~known]
        times = np.column_stack([np.full(len(new), time), np.zeros(len(new))])
        self._rows = np.vstack([self._rows, np.hstack([new, times])])

    def since(self, x: float, y: float, reach: float = SAME_PLACE) -> float:
        """Return since when something is known to stand within `reach`, seconds; inf: nothing."""
        number = self._at(x, y, reach)
        return np.inf if number is None else float(self._rows[number, 3])

    def forget(self, x: float, y: float) -> None:
        """Forget what stood at a place: it has moved."""
        number = self._at(x, y, SAME_PLACE)
        if number is not None:
            self._rows = np.delete(self._rows, number, axis=0)

    def look(self, view: View) -> None:
        """Forget the places that scans in a row see through."""
        if not len(self._rows):
            return
        away = self._rows[:, :2] - view.origin
        distances = np.hypot(away[:, 0], away[:, 1])
        beams = beams_towards(view.scan, np.arctan2(away[:, 1], away[:, 0]) - view.sensor.heading)
        round_turn = round(2.0 * np.pi / abs(view.scan.angle_increment))
        ranges = np.append(view.scan.ranges, np.nan)[
            np.minimum(beams % round_turn, view.scan.ranges.size)
        ]
        # most places are in sight or hidden; only the others are worth an exact look
        passed = ranges > distances + BEHIND
        self._rows[~passed, 4] = 0.0
        for number in np.flatnonzero(passed).tolist():
            x, y, radius, _, scans = self._rows[number].tolist()
            points = view.across(np.array([x, y]), 0.6 * radius)
            self._rows[number, 4] = scans + 1.0 if view.share_passed(points) >= 1.0 else 0.0
        self._rows = self._rows[self._rows[:, 4] < SEEN_THROUGH]

    def _at(self, x: float, y: float, reach: float) -> int | None:
        """Return the row of the nearest place within `reach` metres."""
        if not len(self._rows):
            return None
        away = np.hypot(self._rows[:, 0] - x, self._rows[:, 1] - y)
        nearest = int(away.argmin())
        return nearest if away[nearest] <= reach else None
