"""Lifecycle and timers of activities that run over many control steps and can be paused.

There is one clock, the body's, and it goes on while the robot is held. The owner of an activity
calls `pause(now)` and `resume(now)`; its timers then leave the time in between out. Nothing infers
a pause from the time between two calls.
"""

from __future__ import annotations


class Lifecycle:
    """Calls around the steps of an activity; each may be left out. Times are seconds."""

    def start(self, now: float) -> None:
        """Begin, before the first step."""

    def pause(self, now: float) -> None:
        """Hold; no steps follow until `resume`."""

    def resume(self, now: float) -> None:
        """Continue; the robot stands, perhaps at another place."""

    def stop(self, now: float) -> None:
        """End, after the last step."""


class Timer:
    """Seconds since an event, without the pauses in between; it stands still during one.

    Args:
        timers: with which it is paused.
    """

    def __init__(self, timers: Timers) -> None:
        self._timers = timers
        self._began: float | None = None

    @property
    def running(self) -> bool:
        """Whether it has been started and not reset."""
        return self._began is not None

    def start(self, now: float) -> None:
        """Start, or start again, at a time in seconds."""
        self._began = now

    def start_once(self, now: float) -> None:
        """Start unless it is running."""
        if self._began is None:
            self._began = now

    def reset(self) -> None:
        """Stop; the elapsed time is 0 again."""
        self._began = None

    def elapsed(self, now: float) -> float:
        """Seconds since the start; 0 while it is not running."""
        if self._began is None:
            return 0.0
        paused_at = self._timers.paused_at
        return now - self._began if paused_at is None else max(0.0, paused_at - self._began)

    def skip(self, paused_at: float, now: float) -> None:
        """Leave out a pause, or the part of it since the start."""
        if self._began is not None:
            self._began += now - max(paused_at, self._began)


class Timers:
    """The timers of one activity, paused and resumed together.

    Attributes:
        paused_at: begin of the present pause, seconds; None while the timers count.
    """

    def __init__(self) -> None:
        self._timers: list[Timer] = []
        self.paused_at: float | None = None

    def new(self) -> Timer:
        """Create a timer of this activity."""
        self._timers.append(Timer(self))
        return self._timers[-1]

    @property
    def paused(self) -> bool:
        """Whether the timers stand still."""
        return self.paused_at is not None

    def pause(self, now: float) -> None:
        """Stop counting; does nothing while paused."""
        if self.paused_at is None:
            self.paused_at = now

    def resume(self, now: float) -> None:
        """Count again, without the time since `pause`; does nothing unless paused."""
        if self.paused_at is None:
            return
        for timer in self._timers:
            timer.skip(self.paused_at, now)
        self.paused_at = None
