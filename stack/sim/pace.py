"""Pace of a simulation on the wall clock; it does not affect the simulation."""

from __future__ import annotations

import time as wall_clock

MAX_DELAY = 0.25
"""Delay behind schedule, wall seconds, above which the schedule restarts from now."""


class Pace:
    """Sleeps so that simulated time passes at a set rate.

    Attributes:
        factor: simulated seconds per wall second; 0: as fast as possible.
        slept: wall seconds slept so far.
    """

    def __init__(self, factor: float) -> None:
        self.factor, self.slept = factor, 0.0
        self._schedule: tuple[float, float] | None = None

    def keep(self, seconds: float) -> None:
        """Sleep until `seconds` of simulated time are over on the wall clock."""
        if self.factor <= 0.0:
            self._schedule = None
            return
        now = wall_clock.monotonic()  # noqa: TID251 - pacing inside a body's wait
        due, factor = self._schedule or (now, self.factor)
        if factor != self.factor or now - due > MAX_DELAY:
            due = now
        due += seconds / self.factor
        self._schedule = (due, self.factor)
        if due > now:
            self.slept += due - now
            wall_clock.sleep(due - now)  # noqa: TID251 - pacing inside a body's wait
