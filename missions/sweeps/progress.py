"""Progress of a sweep, as one line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import perf_counter

from missions.bench.bench import wilson
from missions.sweeps.row import SweepRow, counted

TERMINAL_PERIOD = 0.2
"""Wall seconds between two lines on a terminal."""

PLAIN_PERIOD = 10.0
"""Wall seconds between two lines where lines cannot be overwritten."""


class Progress:
    """Tells how far a sweep is.

    Args:
        total: number of runs.
        show: writes a line over the one before, on a terminal.
        tell: writes a line.
        overwrites: whether there is a terminal.
    """

    def __init__(
        self, total: int, show: Callable[[str], None], tell: Callable[[str], None], *,
        overwrites: bool,
    ) -> None:  # fmt: skip
        self._total, self._show, self._tell = total, show, tell
        self._overwrites = overwrites
        self._began = self._shown_at = perf_counter()
        self._before: int | None = None

    def update(self, rows: Sequence[SweepRow]) -> None:
        """Show the runs that are over, if it is time; the first call says how many were before."""
        if self._before is None:
            self._before = len(rows)
            if rows:
                self._tell(f"{len(rows)} of {self._total} runs are already there")
        period, show = (
            (TERMINAL_PERIOD, self._show) if self._overwrites else (PLAIN_PERIOD, self._tell)
        )
        if perf_counter() - self._shown_at >= period:
            self._shown_at = perf_counter()
            show(self.line(rows))

    def line(self, rows: Sequence[SweepRow]) -> str:
        """Return runs, rate of success with its interval, runs a minute and the time left."""
        done = len(rows)
        minutes = (perf_counter() - self._began) / 60.0
        made = done - (self._before or 0)
        text = f"{done}/{self._total} runs, {rate_text(rows)}"
        if not made:
            return text
        pace = made / max(minutes, 1e-9)
        left = duration_text((self._total - done) / pace)
        return f"{text}, {pace:.1f} runs a minute, {left} left"


def rate_text(rows: Sequence[SweepRow]) -> str:
    """Return the rate of success with its 95 % interval."""
    successes, runs = counted(rows)
    if not runs:
        return "no result yet"
    low, high = wilson(successes, runs)
    return f"success {successes / runs:.1%} ({low:.1%} to {high:.1%})"


def duration_text(minutes: float) -> str:
    """Return a number of minutes with the unit that suits it."""
    seconds = round(60.0 * minutes)
    if seconds < 90:
        return f"{seconds} s"
    return f"{seconds // 60} min" if seconds < 5400 else f"{minutes / 60.0:.1f} h"
