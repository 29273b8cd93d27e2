"""A finished or interrupted sweep, as the report reads it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from missions.sweeps.factors import Factor, Value
from missions.sweeps.row import SweepRow
from missions.sweeps.statistics import groups_of
from missions.sweeps.sweep import MISSION, WORLD, Sweep
from missions.sweeps.table import SweepFolder
from stack.errors import InputError


@dataclass(frozen=True)
class Results:
    """A sweep with its rows.

    Attributes:
        folder: absolute.
        rows: in the order of the runs, at least one.
    """

    folder: Path
    sweep: Sweep
    rows: tuple[SweepRow, ...]

    @property
    def name(self) -> str:
        """Name of the folder."""
        return self.folder.name

    @property
    def counting(self) -> list[SweepRow]:
        """The rows that count in rates."""
        return [row for row in self.rows if row.counts]

    @property
    def varying(self) -> list[Factor]:
        """The factors with more than one value."""
        return [one for one in self.sweep.factors if not one.is_list or len(one.values) > 1]

    @property
    def varied(self) -> list[SweepRow]:
        """Those of them that have a value of each of these: not the baseline of a tuning."""
        names = {factor.name for factor in self.varying}
        return [row for row in self.counting if names <= row.settings.keys()]


@dataclass(frozen=True)
class Level:
    """Runs of which a factor has one value, or one of a range.

    Attributes:
        name: the value, or the ends of the range.
    """

    name: str
    rows: Sequence[SweepRow]


def read_results(folder: Path) -> Results:
    """Read a sweep.

    Raises:
        InputError: the folder holds none, or no run is over.
    """
    place = SweepFolder(folder)
    sweep = place.sweep()
    rows = place.rows(sweep.runs)
    if not rows:
        raise InputError(f"{folder} has no run that is over", "start the sweep, or wait for a run")
    return Results(place.path, sweep, tuple(rows))


def levels_of(factor: Factor, rows: Sequence[SweepRow]) -> list[Level]:
    """Return the runs by the value of a factor: each value, or groups of equally many runs."""
    values = [factor.typed(row.settings[factor.name]) for row in rows]
    groups = groups_of(values)
    found = []
    for group in sorted(set(groups)):
        own = [value for value, of in zip(values, groups, strict=True) if of == group]
        found.append(Level(
            _level_name(factor, own), [row for row, of in zip(rows, groups, strict=True)
                                       if of == group],
        ))  # fmt: skip
    return found


def _level_name(factor: Factor, values: Sequence[Value]) -> str:
    low, high = min(values), max(values)
    if low == high:
        return _shown(low, factor)
    return f"{_shown(low, factor)} to {_shown(high, factor)}"


def _shown(value: Value, factor: Factor) -> str:
    if isinstance(value, float):
        return f"{value:.3g} {factor.unit}".rstrip()
    return Path(str(value)).stem if factor.name in (MISSION, WORLD) else str(value)
