"""Statistics of a fast loop for people and programs: jitter, overruns, percentiles."""

from __future__ import annotations

from dataclasses import dataclass

BIN_ENDS: tuple[float, ...] = tuple(1e-6 * 2.0 ** (number / 2.0) for number in range(48))
"""Seconds; the bins of stack/fast_loop/kernels.py."""


@dataclass(frozen=True, slots=True)
class LoopStatistics:
    """Timing of a fast loop since it began.

    Attributes:
        rate: cycles per second, as wanted.
        cycles: done.
        overruns: deadlines missed by a whole period or more.
        worst: longest time from a deadline until the loop ran, seconds.
        work: mean time that a cycle computes, seconds.
        worst_work: longest, seconds.
        late: number of cycles by their lateness; the bins end at BIN_ENDS.
        lacks: privileges that it did not get: `priority: Operation not permitted`.
    """

    rate: float
    cycles: int = 0
    overruns: int = 0
    worst: float = 0.0
    work: float = 0.0
    worst_work: float = 0.0
    late: tuple[int, ...] = ()
    lacks: tuple[str, ...] = ()

    def percentile(self, share: float) -> float:
        """Lateness that a share of all cycles did not exceed, seconds; the end of its bin."""
        wanted, counted = share * sum(self.late), 0
        for number, end in zip(self.late, BIN_ENDS, strict=False):
            counted += number
            if counted >= wanted:
                return min(end, self.worst)
        return self.worst
