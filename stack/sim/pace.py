"""Pace of a simulation on the wall clock; it does not affect the simulation."""

from __future__ import annotations

import time as wall_clock
from math import inf

MAX_DELAY = 0.25
"""Delay behind schedule, wall seconds, above which the schedule restarts from now."""


class Pace:
    """Sleeps so that simulated time passes at a set rate.

    The time between two steps can be slept in pieces, so that operators are served meanwhile.

    Attributes:
        factor: simulated seconds per wall second; 0: as fast as possible.
        slept: wall seconds slept so far.
    """

    def __init__(self, factor: float) -> None:
        self.factor, self.slept = factor, 0.0
        self._schedule: tuple[float, float] | None = None

    @property
    def due(self) -> float | None:
        """Wall time at which the next step may begin; None without a pace or before the first."""
        return None if self._schedule is None else self._schedule[0]

    def advance(self, seconds: float) -> None:
        """Note that `seconds` of simulated time have passed."""
        if self.factor <= 0.0:
            self._schedule = None
            return
        now = wall_clock.monotonic()  # noqa: TID251 - pacing of a body
        due, factor = self._schedule or (now, self.factor)
        if factor != self.factor or now - due > MAX_DELAY:
            due = now
        self._schedule = (due + seconds / self.factor, self.factor)

    def rest(self, longest: float = inf) -> bool:
        """Sleep until the wall clock has caught up, at most `longest` wall seconds.

        Returns:
            Whether it has caught up. A change of the factor ends the rest.
        """
        if self._schedule is None or self._schedule[1] != self.factor:
            return True
        ahead = self._schedule[0] - wall_clock.monotonic()  # noqa: TID251 - pacing of a body
        if ahead > 0.0:
            asleep = min(ahead, longest)
            self.slept += asleep
            wall_clock.sleep(asleep)  # noqa: TID251 - pacing of a body
        return ahead <= longest
