"""People whose tracks were recorded: they walk as they did, and react to nobody."""

from __future__ import annotations

from math import hypot

import numpy as np

from stack.sim.people.bumps import Bump
from stack.sim.people.loops import Robots
from stack.sim.worlds.world import Person
from stack.types import FloatArray, Pose2D

APPEARANCE_DISTANCE = 1.5
"""Metres from a robot, between the surfaces, at which a person may appear.

Tracks begin anywhere in a recording, where the person was first marked or came out of a house: in a
simulation also inside a robot, which the physics would throw away, or just before it.
"""


class RecordedWalker:
    """One person on a recorded track, which begins again when the recording is over.

    Attributes:
        x: position in the world frame, metres.
        y: position in the world frame, metres.
        is_present: whether the track has begun and not ended, and the person has appeared: the
            first time that no robot was within APPEARANCE_DISTANCE.
    """

    def __init__(self, person: Person, shift: float, robots: Robots = ()) -> None:
        """Begin.

        Args:
            person: with a track.
            shift: seconds of the recording that have passed at time 0.
            robots: where they are at time 0.
        """
        assert person.track is not None
        self._track, self._duration = person.track, person.recorded_duration
        self._radius = person.radius
        self._clock, self._bump = shift % self._duration, Bump()
        self.x = self.y = 0.0
        self.is_present = False
        self._place(robots)

    def walk(self, period: float, robots: Robots, *, touch: float | None = None) -> bool:
        """Advance by `period` seconds; return whether the person moved, came or left.

        Args:
            period: seconds.
            robots: where they are.
            touch: depth by which a robot and the person overlap, metres; None: no touch.
        """
        share = self._bump.share(period, touch)
        if share == 0.0:
            return False
        self._clock = max(0.0, self._clock + period * share)
        before = (self.x, self.y, self.is_present)
        if self._clock >= self._duration:
            self._clock -= self._duration
            self.is_present = False
        self._place(robots)
        return before != (self.x, self.y, self.is_present)

    def _place(self, robots: Robots) -> None:
        times, was_present = self._track[:, 0], self.is_present
        self.is_present = bool(times[0] <= self._clock <= times[-1])
        if not self.is_present:
            return
        self._follow_track(times)
        if not was_present:
            self.is_present = all(self._is_away_from(*robot) for robot in robots)

    def _is_away_from(self, pose: Pose2D, radius: float) -> bool:
        away = hypot(self.x - pose.x, self.y - pose.y)
        return away >= radius + self._radius + APPEARANCE_DISTANCE

    def _follow_track(self, times: FloatArray) -> None:
        last = min(max(int(np.searchsorted(times, self._clock, "right")) - 1, 0), len(times) - 2)
        span = times[last + 1] - times[last]
        share = (self._clock - times[last]) / span
        # Cubic Hermite interpolation: continuous velocity from sample to sample.
        a, b = share * share * (3.0 - 2.0 * share), share * (1.0 - share)
        (x0, y0, vx0, vy0), (x1, y1, vx1, vy1) = self._track[last : last + 2, 1:].tolist()
        self.x = float(x0 + a * (x1 - x0) + b * span * ((1.0 - share) * vx0 - share * vx1))
        self.y = float(y0 + a * (y1 - y0) + b * span * ((1.0 - share) * vy0 - share * vy1))
