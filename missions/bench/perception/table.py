"""What the tables of `bench line`, `docking` and `follow` share: outcomes, groups and reports."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Generic, Self, TypeVar

from missions.bench.localisation.report import wilson
from missions.bench.resumable import Keyed, Row, TableOptions, Work, fill, record_settings
from missions.execution.report import Report
from stack.telemetry.records import MissionState

PASSED, FAILED = "passed", "failed"


class RunRow:
    """Base of the rows: dataclasses with a status and a cause."""

    __slots__ = ()
    status: str
    cause: str

    @classmethod
    def read(cls, values: dict[str, Any]) -> Self:
        """Return a row from the values of its JSON.

        Raises:
            TypeError: they are not those of a row.
        """
        missing = {field.name for field in fields(cls)} - values.keys()  # type: ignore[arg-type]
        if missing:
            raise TypeError(f"missing: {', '.join(sorted(missing))}")
        return cls(**values)

    @property
    def success(self) -> bool:
        """Whether the run passed."""
        return self.status == PASSED

    def outcome(self, figures: str) -> str:
        """Return figures as text, after the cause of a run that did not pass."""
        return figures if self.success else f"{self.cause}; {figures}"


E = TypeVar("E", bound=Keyed)
R = TypeVar("R", bound=RunRow)
T = TypeVar("T", bound=Row)
L = TypeVar("L", bound=Hashable)


def ending(report: Report) -> tuple[str, str]:
    """Return the status of a run that passes with the mission's success, and the cause."""
    if report.status == MissionState.SUCCESS:
        return PASSED, ""
    return FAILED, report.reason or str(report.status)


def measure(
    entries: Sequence[E], settings: Callable[[E], tuple[str, Mapping[str, Any]]],
    options: TableOptions, work: Work[E, T], log: Callable[[str], None],
) -> list[T]:  # fmt: skip
    """Make the runs that are missing in a table; return all.

    `settings` returns a label and the settings of an entry, to be compared with those of the
    results that are already there.

    Raises:
        InputError: the folder has results of other settings.
    """
    record_settings(options.out, {label: dict(used) for label, used in map(settings, entries)})
    return fill(entries, options, work, log)


@dataclass(frozen=True)
class Group(Generic[R]):
    """Rows with the same label."""

    rows: Sequence[R]

    @property
    def good(self) -> Sequence[R]:
        """The runs that passed; all if none did."""
        return [row for row in self.rows if row.success] or self.rows

    def share(self, meets: Callable[[R], bool] = lambda row: row.success) -> str:
        """Return how many rows meet a condition, of how many; default: passed."""
        return f"{sum(meets(row) for row in self.rows)}/{len(self.rows)}"

    @property
    def interval(self) -> str:
        """95 % confidence interval of the rate of success."""
        low, high = wilson(sum(row.success for row in self.rows), len(self.rows))
        return f"{low:.0%} to {high:.0%}"


def groups(rows: Sequence[R], label: Callable[[R], L]) -> dict[L, Group[R]]:
    """Return the rows by label, in order of appearance."""
    labels = dict.fromkeys(map(label, rows))
    return {one: Group([row for row in rows if label(row) == one]) for one in labels}


def failures(rows: Sequence[R], line: Callable[[R], str]) -> list[str]:
    """Return a line for each run that did not pass."""
    return [line(row) for row in rows if not row.success]
