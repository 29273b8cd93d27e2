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

    Attributes:
        due: the next time.
        due_step: the first whole step that is not before the next time.
    """

    def __init__(self, period: float, start: float = 0.0) -> None:
        self._period, self._start, self._taken = period, start, 0
        self._plan()

    def _plan(self) -> None:
        self.due = self._start + self._taken * self._period
        self._earliest = self.due - ROUNDING * self._period
        self.due_step = ceil(self._earliest)

    def is_due(self, now: float) -> bool:
        """Return whether the next time has come."""
        return now >= self._earliest

    def take(self, now: float) -> bool:
        """Return whether the next time has come, and then go on to the first one after `now`."""
        if now < self._earliest:
            return False
        if now > self.due + (1.0 + ROUNDING) * self._period:
            self._start, self._taken = now, 0
        self._taken = floor((now - self._start) / self._period + ROUNDING) + 1
        self._plan()
        return True
