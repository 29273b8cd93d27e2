"""How long a worker is waited for, by what it does: a busy machine gives up no sound worker."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

IDLE = 0.01
"""Share of the wall time that a worker computes at least; one that computes less does nothing."""


class Patience:
    """Time for which an answer of a worker is waited for.

    It is over when the worker has computed for LONGEST, or has done nothing for as long. Time in
    which other processes have the processor is neither.

    Args:
        computed: returns the processor time of the worker, seconds.
        longest: seconds in place of LONGEST.
    """

    LONGEST: ClassVar[float] = 30.0
    """Seconds. Sound workers compute for a few seconds at most."""

    def __init__(self, computed: Callable[[], float], longest: float | None = None) -> None:
        self._computed = computed
        self._longest = self.LONGEST if longest is None else longest
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
        if self._at - self._active_at > IDLE * self._longest:
            self._active_at, self._idle = self._at, 0.0

    @property
    def left(self) -> float:
        """Seconds for which the worker is still waited for at least; 0: no longer."""
        return max(0.0, self._longest - max(self._work, self._idle))


def process_state(process: int) -> tuple[str, float]:
    """Return state and processor time, seconds, of a process (proc(5), `stat`).

    The state is a letter, as T for one that is stopped; X and 0 if it has ended.
    """
    try:
        stat = Path(f"/proc/{process}/stat").read_text()
    except OSError:
        return "X", 0.0
    state, *_ = fields = stat.rpartition(")")[2].split()
    return state, (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def processor_time(process: int) -> float:
    """Return what a process has computed so far, seconds; 0 if it has ended."""
    return process_state(process)[1]
