"""Schedule of something periodic. Times are counted, so that rounding never adds up."""

from __future__ import annotations

from math import ceil, floor

ROUNDING = 1e-6
"""Periods by which a time may be early; the sums of control periods differ by less."""


class Schedule:
    """Times of something that happens at a rate: `start + n * period`.

    After a pause of more than a period the count starts again at the end of the pause: a
    camera that is asked for a picture takes it at once.

    Args:
        period: seconds, or steps of a clock.
        start: the first time.
    """

    def __init__(self, period: float, start: float = 0.0) -> None:
        self._period, self._start, self._taken = period, start, 0

    @property
    def due(self) -> float:
        """The next time."""
        return self._start + self._taken * self._period

    @property
    def due_step(self) -> int:
        """The first whole step that is not before the next time."""
        return ceil(self.due - ROUNDING * self._period)

    def is_due(self, now: float) -> bool:
        """Return whether the next time has come."""
        return now >= self.due - ROUNDING * self._period

    def take(self, now: float) -> bool:
        """Return whether the next time has come, and then go on to the first one after `now`."""
        if not self.is_due(now):
            return False
        if now > self.due + (1.0 + ROUNDING) * self._period:
            self._start, self._taken = now, 0
        self._taken = floor((now - self._start) / self._period + ROUNDING) + 1
        return True
