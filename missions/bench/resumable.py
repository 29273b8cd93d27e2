"""Resumable table of runs: filled by several processes, written row by row.

The caller defines entries (what to run), rows (the results) and the function that makes a row of
an entry.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from statistics import mean
from typing import Any, Generic, Protocol, TypeVar

from missions.bench.processes import ProcessEnded, results
from stack.documents import Finding, Mark
from stack.documents.files import JSON_BYTES, decoded, read_bytes, read_input
from stack.errors import InputError, exception_sentence, traceback_text

TABLE, SETTINGS = "runs.jsonl", "settings.json"

RUNS_PER_PROCESS = 40
"""PyBullet frees meshes, about 10 MB per world, only at the end of the process."""

Key = tuple[str, str, int]
Log = Callable[[str], None]


class Keyed(Protocol):
    """An entry with a unique key."""

    @property
    def key(self) -> Key:
        """Unique key in the table."""
        ...


class Row(Keyed, Protocol):
    """The result of an entry: a dataclass of JSON-compatible values."""

    @property
    def wall_seconds(self) -> float:
        """Compute time, seconds."""
        ...


E = TypeVar("E", bound=Keyed)
R = TypeVar("R", bound=Row)


@dataclass(frozen=True)
class TableOptions:
    """Folder of the table, and number of processes that fill it."""

    out: Path
    jobs: int = 1


@dataclass(frozen=True)
class Work(Generic[E, R]):
    """Functions of a table.

    Attributes:
        make: runs an entry. A top-level function or a partial of one: it is pickled.
        read: returns a row from the values of its JSON; raises KeyError, TypeError or ValueError
            if they are not a row.
        line: returns a row as one line of progress.
        crashed: returns the row of an entry whose run raised an exception, from the entry and a
            sentence; None ends the table with the exception. Wrong input always ends it.
    """

    make: Callable[[E], R]
    read: Callable[[dict[str, Any]], R]
    line: Callable[[R], str]
    crashed: Callable[[E, str], R] | None = None

    def row(self, entry: E) -> R:
        """Run an entry; a crash is a row, so that the other runs go on.

        Raises:
            InputError: the mission or a file has errors, which all runs would have.
        """
        try:
            return self.make(entry)
        except InputError:
            raise
        except Exception as error:
            if self.crashed is None:
                raise
            print(traceback_text(f"the run {entry.key} crashed", error), file=sys.stderr)
            return self.crashed(entry, exception_sentence(error))


def record_settings(out: Path, settings: dict[str, Any]) -> None:
    """Write the settings of the results, by label; compare them with those in the folder.

    Raises:
        InputError: the folder has results of other settings.
    """
    out.mkdir(parents=True, exist_ok=True)
    file = out / SETTINGS
    known: dict[str, Any] = json.loads(read_bytes(file, JSON_BYTES)) if file.exists() else {}
    for label, plain in json.loads(json.dumps(settings, default=str)).items():
        if known.setdefault(label, plain) != plain:
            raise InputError(
                f"{out} has results of other settings (see {SETTINGS}); choose another --out"
            )
    file.write_text(json.dumps(known, indent=2), "utf-8")


def fill(entries: Sequence[E], options: TableOptions, work: Work[E, R], log: Log) -> list[R]:
    """Make the runs that are missing in the table; return all rows, in the order of the entries.

    Raises:
        InputError: the file in the folder is not a table of such rows.
    """
    options.out.mkdir(parents=True, exist_ok=True)
    wanted = {entry.key: entry for entry in entries}
    done = {key: row for key, row in rows_in(options.out, work).items() if key in wanted}
    if done:
        log(f"{len(done)} of {len(wanted)} runs are already in {options.out / TABLE}")
    missing = [entry for key, entry in wanted.items() if key not in done]
    seconds: list[float] = []
    with (options.out / TABLE).open("a", encoding="utf-8") as table:
        for row in _rows(missing, options.jobs, work):
            table.write(json.dumps(asdict(row)) + "\n")  # type: ignore[call-overload]
            table.flush()
            done[row.key] = row
            seconds.append(row.wall_seconds)
            remaining = mean(seconds) * (len(missing) - len(seconds)) / options.jobs
            log(f"{len(done):4d}/{len(wanted)}  {work.line(row)}{_remaining(remaining)}")
    return [done[key] for key in wanted]


def rows_in(folder: Path, work: Work[E, R]) -> dict[Key, R]:
    """Read the rows of a table; drop a last line cut off by an interruption.

    Raises:
        InputError: a line is not a row of this table.
    """
    rows: dict[Key, R] = {}
    file = folder / TABLE
    if not file.exists():
        return rows
    text = decoded(read_input(file, "table", JSON_BYTES), file)
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        file.write_text(whole, "utf-8")
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            row = work.read(json.loads(line))
        except (ValueError, TypeError, KeyError) as error:
            mark = Mark(str(file), number)
            sentence = f"not a row of this table: {error}"
            raise InputError([Finding(mark, "E004", sentence, "choose another --out")]) from None
        rows[row.key] = row
    return rows


def _remaining(seconds: float) -> str:
    """Return the estimated remaining time as text."""
    if seconds < 1.0:
        return ""
    return f"; {seconds:.0f} s left" if seconds < 90.0 else f"; {seconds / 60.0:.0f} min left"


def _rows(entries: Sequence[E], jobs: int, work: Work[E, R]) -> Iterator[R]:
    """Yield the rows in the order in which the runs finish."""
    if len(entries) < 2 or (jobs == 1 and len(entries) <= RUNS_PER_PROCESS):
        yield from map(work.row, entries)
        return
    for entry, result in results(work.row, entries, jobs, RUNS_PER_PROCESS):
        if isinstance(result, ProcessEnded):
            if work.crashed is None:
                raise RuntimeError(f"the run {entry.key} ended its process: {result.reason}")
            yield work.crashed(entry, result.reason)
        elif isinstance(result, BaseException):
            raise result
        else:
            yield result
