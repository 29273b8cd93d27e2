"""People whose tracks were recorded: they walk as they did, and react to nobody."""

from __future__ import annotations

import numpy as np

from stack.sim.people.bumps import Bump
from stack.sim.worlds.world import Person


class RecordedWalker:
    """One person on a recorded track, which begins again when the recording is over.

    Attributes:
        x: position in the world frame, metres.
        y: position in the world frame, metres.
        is_present: whether the track has begun and not ended.
    """

    def __init__(self, person: Person, shift: float) -> None:
        """Begin.

        Args:
            person: with a track.
            shift: seconds of the recording that have passed at time 0.
        """
        assert person.track is not None
        self._track, self._duration = person.track, person.recorded_duration
        self._clock, self._bump = shift % self._duration, Bump()
        self.x = self.y = 0.0
        self.is_present = False
        self._place()

    def walk(self, period: float, *, touch: float | None = None) -> bool:
        """Advance by `period` seconds; return whether the person moved, came or left.

        Args:
            period: seconds.
            touch: depth by which a robot and the person overlap, metres; None: no touch.
        """
        share = self._bump.share(period, touch)
        if share == 0.0:
            return False
        self._clock = max(0.0, self._clock + period * share)
        if self._clock >= self._duration:
            self._clock -= self._duration
        before = (self.x, self.y, self.is_present)
        self._place()
        return before != (self.x, self.y, self.is_present)

    def _place(self) -> None:
        times = self._track[:, 0]
        self.is_present = bool(times[0] <= self._clock <= times[-1])
        if not self.is_present:
            return
        last = min(max(int(np.searchsorted(times, self._clock, "right")) - 1, 0), len(times) - 2)
        span = times[last + 1] - times[last]
        share = (self._clock - times[last]) / span
        # Cubic Hermite interpolation: continuous velocity from sample to sample.
        a, b = share * share * (3.0 - 2.0 * share), share * (1.0 - share)
        (x0, y0, vx0, vy0), (x1, y1, vx1, vy1) = self._track[last : last + 2, 1:].tolist()
        self.x = float(x0 + a * (x1 - x0) + b * span * ((1.0 - share) * vx0 - share * vx1))
        self.y = float(y0 + a * (y1 - y0) + b * span * ((1.0 - share) * vy0 - share * vy1))
