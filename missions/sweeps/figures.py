"""Figures of runs: their names, units, and values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import mean, median

from missions.bench.bench import wilson
from missions.sweeps.row import CRASHED, HUNG, KILLED, REFUSED, SweepRow, counted

Figure = Callable[[Sequence[SweepRow]], float | None]


@dataclass(frozen=True, slots=True)
class Measure:
    """What each run has a value of.

    Attributes:
        title: in words. unit: of the values.
        read: returns the value of a run; None if it has none.
        of_successes: whether sweeps are judged by the values of their successful runs alone.
    """

    title: str
    unit: str
    read: Callable[[SweepRow], float | None]
    of_successes: bool = False

    def values(self, rows: Sequence[SweepRow]) -> list[float]:
        """Return the values of runs that have one."""
        return [value for row in rows if (value := self.read(row)) is not None]

    def judged(self, rows: Sequence[SweepRow]) -> list[float]:
        """Return the values by which a sweep is judged."""
        return self.values([row for row in rows if row.is_success or not self.of_successes])


MEASURES = {
    "time": Measure("simulated time", "s", lambda row: row.seconds, of_successes=True),
    "distance": Measure("driven distance", "m", lambda row: row.distance, of_successes=True),
    "clearance": Measure("least clearance", "m", lambda row: row.clearance),
    "error": Measure("largest pose error", "m", lambda row: row.error_max),
    "collisions": Measure("collisions", "contacts", lambda row: row.collisions),
}

SHOWN = ("time", "distance", "clearance", "error")
"""Measures whose distributions are shown and compared."""


def _rate(rows: Sequence[SweepRow]) -> float | None:
    successes, runs = counted(rows)
    return successes / runs if runs else None


def _share_of(*outcomes: str) -> Figure:
    def share(rows: Sequence[SweepRow]) -> float | None:
        return sum(row.outcome in outcomes for row in rows) / len(rows) if rows else None

    return share


def _of(name: str, summary: Callable[[list[float]], float]) -> Figure:
    def figure(rows: Sequence[SweepRow]) -> float | None:
        values = MEASURES[name].judged(rows)
        return summary(values) if values else None

    return figure


FIGURES: dict[str, Figure] = {
    "success": _rate,
    "success.low": lambda rows: wilson(*counted(rows))[0],
    "crashed": _share_of(CRASHED, HUNG, KILLED),
    "refused": _share_of(REFUSED),
    "collisions": _of("collisions", mean),
    "time": _of("time", median),
    "clearance": _of("clearance", min),
    "error": _of("error", max),
}
"""Figures of a sweep for conditions: rate of success and the lower end of its 95 % interval; share
of runs that crashed, hung or were killed, and of refused ones; contacts a run; median time of the
successes; least clearance; largest error of the pose."""

RATES = ("success", "success.low", "crashed", "refused")
"""Figures from 0 to 1."""
