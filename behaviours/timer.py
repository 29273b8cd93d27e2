"""Timers that stand still while the mission is paused.

A pause has a beginning and an end, `pause(now)` and `resume(now)`, with times of the robot's clock.
There is no second clock: `resume` moves the start of a timer by the length of the pause. The timers
of stack/lifecycle.py work alike, but get the time with each call; these read it from their robot.
"""

from __future__ import annotations

from typing import Protocol

ROUNDING = 1e-9
"""Seconds; a clock summed from periods has rounding errors."""


class Clock(Protocol):
    """What has the robot's clock: a robot, or the state of a tree."""

    @property
    def time(self) -> float:
        """Seconds on the robot's clock."""


class Timer:
    """Seconds since a start on the robot's clock, without pauses of the mission."""

    __slots__ = ("__weakref__", "_clock", "_paused_at", "_start")

    def __init__(self, clock: Clock) -> None:
        """Prepare the timer; `restart` starts it."""
        self._clock, self._start = clock, 0.0
        self._paused_at: float | None = None

    def restart(self) -> None:
        """Count from now on."""
        self._start, self._paused_at = self._clock.time, None

    @property
    def elapsed(self) -> float:
        """Seconds since the start."""
        return self._now - self._start

    def left(self, limit: float) -> float:
        """Return the seconds until a limit after the start; negative after it."""
        return self._start + limit - self._now

    def is_over(self, limit: float) -> bool:
        """Return whether a limit after the start, seconds, is reached."""
        return self.left(limit) <= ROUNDING

    def pause(self, now: float) -> None:
        """Stand still until `resume`; no effect while paused."""
        if self._paused_at is None:
            self._paused_at = now

    def resume(self, now: float) -> None:
        """Leave out the time since `pause`; no effect while not paused."""
        if self._paused_at is not None:
            self.shift(now - self._paused_at)
            self._paused_at = None

    def shift(self, seconds: float) -> None:
        """Leave out an interruption of `seconds` that is over."""
        self._start += seconds

    @property
    def _now(self) -> float:
        return self._clock.time if self._paused_at is None else self._paused_at
