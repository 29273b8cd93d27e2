"""Standoffs: a person is in the way of a drive; waited for with a patience in seconds."""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot, inf

import numpy as np

from stack.errors import NavigationError
from stack.geometry.path_progress import PathProgress
from stack.lifecycle import Timers
from stack.navigation.landmarks import Landmarks
from stack.navigation.parameters import NavigationParameters
from stack.types import FailureCode, FloatArray, Limitation, Perceived, Pose2D, TrackedObject
from stack.types.limitations import PERSON, STOPPED

PERSON_DISTANCE = 1.5
"""Metres to a person ahead who is in the way."""

BESIDE = 0.5
"""Metres between the surface of a person and the path within which they are in the way."""

GONE_AFTER = 1.0
"""Seconds after which a person who is not in the way any more does not come back."""

STANDING_SPEED = 0.2
"""m/s below which the person in the way stands."""

OVER_AFTER_WAY = 0.5
"""Metres of way after which a standoff is over although there is still a person ahead."""


class Standoff:
    """Whether a person is in the way of a drive, and for how long.

    Args:
        timers: of the drive: pauses do not count.
        landmarks: names of places, for the failure.

    Attributes:
        person: who is in the way now, map frame; None: nobody.
    """

    def __init__(self, timers: Timers, landmarks: Landmarks) -> None:
        self._landmarks = landmarks
        self._since, self._away, self._stood = (timers.new() for _ in range(3))
        self._best = inf
        self.person: TrackedObject | None = None

    def lasts(self, now: float) -> float:
        """Return the seconds for which a person has been in the way."""
        return 0.0 if self.person is None else self._since.elapsed(now)

    def stood(self, now: float) -> float:
        """Return the seconds for which the person in the way has stood."""
        return self._stood.elapsed(now) if self._stood.running else 0.0

    def limitation(self, pose: Pose2D) -> Limitation | None:
        """Return that the robot stands for the person in the way; None if nobody is.

        Args:
            pose: of the robot, map frame.
        """
        if self.person is None:
            return None
        (x, y), radius = self.person.position, self.person.radius
        there = Pose2D(x, y).relative_to(pose)
        away = max(0.0, hypot(there.x, there.y) - radius)
        return Limitation(STOPPED, PERSON, f"a person {away:.1f} m away", (there.x, there.y))

    def end(self) -> None:
        """Forget it: the robot has left the way meanwhile."""
        self._since.reset()
        self._stood.reset()
        self._away.reset()
        self.person = None

    def update(
        self, perceived: Perceived, progress: PathProgress, parameters: NavigationParameters
    ) -> None:
        """Look who is in the way.

        Args:
            perceived: in this step.
            progress: on the path of the drive.
            parameters: the patience.

        Raises:
            NavigationError: BLOCKED_BY_PERSON when the patience is over.
        """
        path = (
            progress.ahead(PERSON_DISTANCE + BESIDE) if perceived.world.tracks else np.empty((0, 2))
        )
        near_path = [track for track in perceived.world.tracks if _is_beside(path, track)]
        now, person = perceived.time, nearest(near_path, perceived.estimate.pose, PERSON_DISTANCE)
        self.face(person, now)
        if person is None:
            return
        if progress.remaining < self._best - OVER_AFTER_WAY:
            self._since.start(now)
            self._best = progress.remaining
        if self._since.elapsed(now) >= parameters.person_patience:
            self._since.reset()
            raise blocked_by(person, parameters.person_patience, self._landmarks)

    def face(self, person: TrackedObject | None, now: float) -> None:
        """Set the person in the way; None: nobody."""
        self.person = person
        if person is None or person.speed >= STANDING_SPEED:
            self._stood.reset()
        else:
            self._stood.start_once(now)
        if person is None:
            self._away.start_once(now)
            if self._away.elapsed(now) >= GONE_AFTER:
                self._since.reset()
            return
        self._away.reset()
        if not self._since.running:
            self._since.start(now)
            self._best = inf


def nearest(tracks: Sequence[TrackedObject], pose: Pose2D, reach: float) -> TrackedObject | None:
    """Return who is nearest to a pose, if their surface is within a distance; map frame, metres."""

    def away(track: TrackedObject) -> float:
        x, y = track.position
        return hypot(x - pose.x, y - pose.y) - track.radius

    found = min(tracks, key=away, default=None)
    return None if found is None or away(found) > reach else found


def _is_beside(path: FloatArray, track: TrackedObject) -> bool:
    """Whether a person is near a path (n, 2), map frame."""
    if not len(path):
        return False
    x, y = track.position
    aside = float(np.hypot(path[:, 0] - x, path[:, 1] - y).min())
    return aside - track.radius <= BESIDE


def blocked_by(person: TrackedObject, seconds: float, landmarks: Landmarks) -> NavigationError:
    """Return the failure of a drive that a person has blocked for some seconds."""
    where = landmarks.where(person.position)
    sentence = f"a person has been in the way for {seconds:.0f} s, at {where}"
    return NavigationError(FailureCode.BLOCKED_BY_PERSON, sentence)
