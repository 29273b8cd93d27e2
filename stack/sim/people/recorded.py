"""People whose tracks were recorded: they walk as they did, and react to nobody."""

from __future__ import annotations

from math import hypot, nan

import numpy as np

from stack.sim.people.bumps import Bump
from stack.sim.people.loops import Robots
from stack.sim.worlds.world import Person
from stack.types import FloatArray

APPEARANCE_DISTANCE = 1.5
"""Metres from a robot, between the surfaces, at which a person may appear.

Tracks begin anywhere in a recording, where the person was first marked or came out of a house: in a
simulation also inside a robot, which the physics would throw away, or just before it.
"""

NOWHERE = (nan, nan)
"""Place of a person who is not in the world."""


class RecordedWalker:
    """One person on a recorded track, which begins again when the recording is over.

    Attributes:
        place: position in the world frame, metres; NOWHERE while the track has not begun or has
            ended, and until the first time that no robot is within APPEARANCE_DISTANCE.
    """

    def __init__(self, person: Person, shift: float, robots: Robots = ()) -> None:
        """Begin when `shift` seconds of the recording have passed."""
        assert person.track is not None
        self._track, self._duration = person.track, person.recorded_duration
        self._radius = person.radius
        self._clock, self._bump = shift % self._duration, Bump()
        self.place = NOWHERE
        self._move(robots)

    def walk(self, period: float, robots: Robots, *, touch: float | None = None) -> bool:
        """Advance by `period` seconds; return whether the person moved, came or left.

        `touch` is the depth by which a robot and the person overlap, metres; None: no touch.
        """
        share = self._bump.share(period, touch)
        if share == 0.0:
            return False
        self._clock = max(0.0, self._clock + period * share)
        before = self.place
        if self._clock >= self._duration:
            self._clock -= self._duration
            self.place = NOWHERE
        self._move(robots)
        return before != self.place

    def _move(self, robots: Robots) -> None:
        times, was_present = self._track[:, 0], self.place is not NOWHERE
        if not times[0] <= self._clock <= times[-1]:
            self.place = NOWHERE
            return
        self.place = x, y = self._on_track(times)
        if not was_present and any(
            hypot(x - pose.x, y - pose.y) < radius + self._radius + APPEARANCE_DISTANCE
            for pose, radius in robots
        ):
            self.place = NOWHERE

    def _on_track(self, times: FloatArray) -> tuple[float, float]:
        last = min(max(int(np.searchsorted(times, self._clock, "right")) - 1, 0), len(times) - 2)
        span = times[last + 1] - times[last]
        share = (self._clock - times[last]) / span
        # Cubic Hermite interpolation: continuous velocity from sample to sample.
        a, b = share * share * (3.0 - 2.0 * share), share * (1.0 - share)
        (x0, y0, vx0, vy0), (x1, y1, vx1, vy1) = self._track[last : last + 2, 1:].tolist()
        x = float(x0 + a * (x1 - x0) + b * span * ((1.0 - share) * vx0 - share * vx1))
        y = float(y0 + a * (y1 - y0) + b * span * ((1.0 - share) * vy0 - share * vy1))
        return x, y
