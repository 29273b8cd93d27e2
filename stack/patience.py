"""How long a worker is waited for, by what it does: a busy machine gives up no sound worker."""

from __future__ import annotations

from collections.abc import Callable
from typing import ClassVar

IDLE = 0.01
"""Share of the wall time that a worker computes at least; one that computes less does nothing."""


class Patience:
    """Time for which an answer of a worker is waited for.

    It is over when the worker has computed for LONGEST, or has done nothing for as long. Time in
    which other processes have the processor is neither.

    Args:
        computed: returns the processor time of the worker, seconds.
    """

    LONGEST: ClassVar[float] = 30.0
    """Seconds. Sound workers compute for a few seconds at most."""

    def __init__(self, computed: Callable[[], float]) -> None:
        self._computed = computed
        self.begin()

    @classmethod
    def is_over(cls, due: float, now: float) -> bool:
        """Whether a late result is given up on hardware, whose clock goes on meanwhile.

        Args:
            due: when the result should have been there, seconds on the robot's clock.
            now: likewise.
        """
        return now > due + cls.LONGEST

    def begin(self) -> None:
        """Wait for another answer from now on."""
        self._at = self._active_at = self._computed()
        self._work = self._idle = 0.0

    def spend(self, waited: float) -> None:
        """Count some wall seconds of waiting."""
        before, self._at = self._at, self._computed()
        self._work += min(max(0.0, self._at - before), waited)  # it may have several threads
        self._idle += waited
        if self._at - self._active_at > IDLE * self.LONGEST:
            self._active_at, self._idle = self._at, 0.0

    @property
    def left(self) -> float:
        """Seconds for which the worker is still waited for at least; 0: no longer."""
        return max(0.0, self.LONGEST - max(self._work, self._idle))
