"""People who ran into the robot and stand before it: they are expected to go on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from stack.safety.monitor import moving_discs
from stack.types import FloatArray, Pose2D, TrackedObject

WALKING_SPEED = 0.3
"""m/s from which a person counts as walking."""

STOPPED_SPEED = 0.2
"""m/s below which a person has stopped."""

TOUCHING = 0.6
"""Metres between the base and the surface of a person who may have run into the robot."""

SETS_OFF = 1.0
"""Seconds after which a person who stands before the robot is expected to go on."""

FORGOTTEN_AFTER = 6.0
"""Seconds after which a person who has stopped is not expected to go on any more."""


@dataclass(frozen=True, slots=True)
class _Walk:
    """The last walk of a person: velocity in the map frame, and when they walked."""

    velocity: tuple[float, float]
    time: float


class PushingPeople:
    """Remembers how people near the robot walked before they stopped."""

    def __init__(self) -> None:
        self._walks: dict[int, _Walk] = {}

    def clear(self) -> None:
        """Forget everybody."""
        self._walks.clear()

    def expected(
        self, time: float, tracks: Sequence[TrackedObject], pose: Pose2D, discs: FloatArray
    ) -> FloatArray:
        """Return the discs with the velocities expected of them, and when they set off.

        Args:
            time: seconds.
            tracks: map frame.
            pose: of the base, map frame.
            discs: (k, 5) of the tracks, base frame.

        Returns:
            (k, 6): the last column is the time until the disc sets off, seconds.
        """
        known = {track.id: self._walk(track, time) for track in tracks}
        self._walks = {number: walk for number, walk in known.items() if walk is not None}
        found = np.zeros((len(discs), 6))
        found[:, :5] = discs
        for row, track in enumerate(tracks):
            walk = self._walks.get(track.id)
            if walk is None or hypot(*track.velocity) >= STOPPED_SPEED:
                continue
            x, y, radius = discs[row, 0], discs[row, 1], discs[row, 4]
            if hypot(x, y) - radius > TOUCHING or time - walk.time > FORGOTTEN_AFTER:
                continue
            again = TrackedObject(
                track.id, time, track.position, walk.velocity, track.radius, track.covariance
            )
            moved = moving_discs([again], pose)[0, 2:4]
            if x * moved[0] + y * moved[1] < 0.0:
                found[row, 2:4] = moved
                found[row, 5] = max(0.0, SETS_OFF - (time - walk.time))
        return found

    def _walk(self, track: TrackedObject, time: float) -> _Walk | None:
        if hypot(*track.velocity) >= WALKING_SPEED:
            return _Walk(track.velocity, time)
        return self._walks.get(track.id)
