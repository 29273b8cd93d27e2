"""Statistics of the fast loop, counted in each cycle: how late it wakes, how long it computes."""

from __future__ import annotations

from math import log2

from numba import i8

from stack.kernel_cache import njit

CYCLES, OVERRUNS, WORST_LATE, WORST_WORK, TOTAL_WORK = range(5)
"""Numbers of cycles and of deadlines missed; nanoseconds."""
BINS = 8
"""Number of cycles by their lateness, from here on."""
BIN_COUNT = 48
"""The first ends at 1 µs, each other one at sqrt(2) times the last one's end: the last at 12 s."""


@njit(cache=True, nogil=True)
def count_cycle(statistics, late, work, missed):  # type: ignore[no-untyped-def]
    """Count one cycle.

    Args:
        statistics: (64,) int64.
        late: nanoseconds from the deadline until the loop ran.
        work: nanoseconds of the last cycle's work.
        missed: deadlines that passed meanwhile.
    """
    statistics[CYCLES] += 1
    statistics[OVERRUNS] += missed
    statistics[WORST_LATE] = max(statistics[WORST_LATE], late)
    statistics[WORST_WORK] = max(statistics[WORST_WORK], work)
    statistics[TOTAL_WORK] += work
    number = 0 if late < 1000 else int(2.0 * log2(late / 1000.0)) + 1
    statistics[BINS + min(number, BIN_COUNT - 1)] += 1


COUNT = ((count_cycle, (i8[::1], i8, i8, i8)),)
"""The entry point, with the types that the loop calls it with."""
