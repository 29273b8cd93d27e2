"""What a benchmark is: its runs, how one of them becomes a row, and its table."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from hashlib import sha256
from math import sqrt
from pathlib import Path
from time import perf_counter
from typing import Any, Generic, Protocol, Self, TypeVar

from stack.columns import columns
from stack.errors import InputError, exception_sentence, traceback_text

Key = tuple[str | int, ...]
Rows = list[dict[str, Any]]

PASSED, FAILED, CRASHED = "passed", "failed", "crashed"
"""Statuses of a run; `crashed`: it ended with an exception, or its process ended."""

CAUSES = "failed"
"""Column with the causes of all failures of a row of a table; it is listed below the table."""

PICTURES, WORLDS = "failures", "worlds"
"""Folders of the pictures of failed runs and of the generated worlds."""

LONGEST_NAME = 160
"""Characters of the name of a picture."""


@dataclass(frozen=True)
class Options:
    """What the command line chooses; each bench reads what it needs.

    Attributes:
        out: folder of the results. jobs: number of processes.
        seeds: of the runs. names: of missions, courses or other cases; empty: all.
        robots, controllers, people: to compare; empty controllers: that of the mission.
        parameters: `controller.cruise_speed` -> value as text.
        keep: folder for the records of each run; None keeps none.
    """

    out: Path
    jobs: int = 1
    seeds: range = range(1)
    names: tuple[str, ...] = ()
    robots: tuple[str, ...] = ()
    controllers: tuple[str, ...] = ()
    people: tuple[str, ...] = ()
    parameters: Mapping[str, str] = field(default_factory=dict)
    keep: Path | None = None

    @property
    def worlds(self) -> Path:
        """Folder of the generated worlds."""
        return self.out / WORLDS


class Keyed(Protocol):
    """A run to make."""

    @property
    def key(self) -> Key:
        """Unique key in the table."""
        ...

    @property
    def label(self) -> str:
        """Name of the settings that it shares with others."""
        ...


def robot_label(robot: str) -> str:
    """Return the name of a robot for keys: a file called robot.yaml is named by its folder."""
    path = Path(robot)
    return path.resolve().parent.name if path.name == "robot.yaml" else path.stem


class Row:
    """Base of the rows: dataclasses of JSON-compatible values.

    Their first fields are the key of the entry; `status`, `cause` and the figures follow, which
    have defaults.
    """

    __slots__ = ()
    status: str
    cause: str
    wall_seconds: float

    @classmethod
    def names(cls) -> list[str]:
        """Return the names of the fields."""
        return [item.name for item in fields(cls)]  # type: ignore[arg-type]

    @classmethod
    def read(cls, values: dict[str, Any]) -> Self:
        """Return a row from the values of its JSON, in which tuples are lists.

        Raises:
            TypeError: they are not those of a row.
        """
        missing = [name for name in cls.names() if name not in values]
        if missing:
            raise TypeError(f"missing: {', '.join(missing)}")
        plain = {k: tuple(v) if isinstance(v, list) else v for k, v in values.items()}
        return cls(**plain)

    @classmethod
    def crashed(cls, key: Key, cause: str) -> Self:
        """Return the row of a run that has no figures."""
        return cls(*key, CRASHED, cause)  # type: ignore[call-arg]

    @property
    def key(self) -> Key:
        """Key of its entry."""
        names = self.names()
        return tuple(getattr(self, name) for name in names[: names.index("status")])

    @property
    def success(self) -> bool:
        """Whether the run passed."""
        return self.status in (PASSED, "success")

    @property
    def title(self) -> str:
        """Which run it was, in words."""
        *names, seed = self.key
        return ", ".join(map(str, filter(None, names))) + f", seed {seed}"

    @property
    def figures(self) -> str:
        """Its most important figures as text."""
        return ""

    @property
    def line(self) -> str:
        """The run as one line."""
        parts = [] if self.success else [f"{self.status.upper()}: {self.cause}"]
        parts += [] if self.status == CRASHED else [self.figures]
        return f"{self.title}: {'; '.join(filter(None, parts))}"


E = TypeVar("E", bound=Keyed)
R = TypeVar("R", bound=Row)
L = TypeVar("L", bound=Hashable)


@dataclass(frozen=True)
class Bench(Generic[E, R]):
    """A benchmark. Filling its table, resuming, pictures, processes and printing are shared.

    Its functions are those of a module: it is pickled for other processes.

    Attributes:
        rows: type of its rows.
        entries: runs to make.
        run: makes the row of an entry; if it failed, it may draw a picture in the given file.
        settings: what the results of all entries with the label of this one depend on.
        table: rows of the table, with the figures of several runs each.
    """

    rows: type[R]
    entries: Callable[[Options], Sequence[E]]
    run: Callable[[E, Path], R]
    settings: Callable[[E], Mapping[str, Any]]
    table: Callable[[Sequence[R]], Rows]

    def row(self, entry: E, out: Path) -> R:
        """Run an entry; a crash is a row, so that the other runs go on.

        Raises:
            InputError: the mission or a file has errors, which all runs would have.
        """
        began = perf_counter()
        try:
            row = self.run(entry, out / PICTURES / f"{picture_name(entry.key)}.png")
        except InputError:
            raise
        except Exception as error:
            print(traceback_text(f"the run {entry.key} crashed", error), file=sys.stderr)
            return self.rows.crashed(entry.key, exception_sentence(error))
        seconds: Any = {"wall_seconds": round(perf_counter() - began, 2)}
        return replace(row, **seconds)  # type: ignore[type-var]

    def report(self, rows: Sequence[R]) -> list[str]:
        """Return the table as lines, and a line per run that failed."""
        failures = [f"  {row.title}: {row.status}: {row.cause}" for row in rows if not row.success]
        return table_lines(self.table(rows)) + failures


def picture_name(key: Key) -> str:
    """Return the name of the picture of a run, without its ending.

    File systems allow 255 bytes: a longer name, of a setup with many parameters, is shortened in
    the middle, and a digest tells it from others.
    """
    name = re.sub(r"[^\w.=-]+", "-", " ".join(map(str, key)), flags=re.ASCII)
    if len(name) <= LONGEST_NAME:
        return name
    digest = sha256(name.encode()).hexdigest()[:8]
    half = LONGEST_NAME // 2
    return f"{name[:half]}-{digest}-{name[-half:]}"


def table_lines(table: Rows) -> list[str]:
    """Return a table as aligned lines, without the column CAUSES."""
    if not table:
        return []
    heads = [head for head in table[0] if head != CAUSES]
    return columns([heads, *([_text(row.get(head)) for head in heads] for row in table)])


def _text(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.3g}" if abs(value) < 0.1 else f"{value:.2f}"
    return "" if value is None else str(value)


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

    def total(self, figure: Callable[[R], int]) -> int:
        """Return the sum of a figure."""
        return sum(map(figure, self.rows))

    @property
    def interval(self) -> str:
        """95 % confidence interval of the rate of success."""
        low, high = wilson(sum(row.success for row in self.rows), len(self.rows))
        return f"{low:.0%} to {high:.0%}"


def groups(rows: Sequence[R], label: Callable[[R], L]) -> dict[L, Group[R]]:
    """Return the rows by label, in order of appearance."""
    labels = dict.fromkeys(map(label, rows))
    return {one: Group([row for row in rows if label(row) == one]) for one in labels}


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of a rate.

    E. B. Wilson, "Probable Inference, the Law of Succession, and Statistical Inference", Journal
    of the American Statistical Association 22, 1927.
    """
    if not trials:
        return 0.0, 1.0
    z, rate = 1.959964, successes / trials
    scale = 1.0 + z * z / trials
    middle = (rate + z * z / (2.0 * trials)) / scale
    half = z / scale * sqrt(rate * (1.0 - rate) / trials + z * z / (4.0 * trials * trials))
    return max(0.0, middle - half), min(1.0, middle + half)
