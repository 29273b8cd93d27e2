"""A table of runs that is written as it grows, filled by processes, and resumed where it stopped.

What a run is, is its owner's business: he brings entries (what to run), rows (what came of it) and
a function from the one to the other.
"""

from __future__ import annotations

import json
import signal
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from multiprocessing import get_context
from pathlib import Path
from statistics import mean
from typing import Any, Generic, Protocol, TypeVar

from stack.documents import Finding, Mark
from stack.errors import InputError

TABLE, SETTINGS = "runs.jsonl", "settings.json"

RUNS_PER_PROCESS = 40
"""PyBullet keeps every mesh it ever loaded, some 10 MB a world, until its process ends."""

Key = tuple[str, str, int]
Tell = Callable[[str], None]


class Keyed(Protocol):
    """An entry: what to run."""

    @property
    def key(self) -> Key:
        """Names it among all of a table."""
        ...


class Row(Keyed, Protocol):
    """What came of an entry, a dataclass of plain values."""

    @property
    def wall_seconds(self) -> float:
        """Compute time."""
        ...


E = TypeVar("E", bound=Keyed)
R = TypeVar("R", bound=Row)


@dataclass(frozen=True)
class TableOptions:
    """Where the table is, and by how many processes it is filled."""

    out: Path
    jobs: int = 1


@dataclass(frozen=True)
class Work(Generic[E, R]):
    """How entries become rows.

    Attributes:
        make: of a module's top level, or a partial of such: it is sent to other processes.
        read: a row from the plain values that JSON made of it; KeyError, TypeError and ValueError
            say that they are none.
        line: a row in a line, for the person who waits.
    """

    make: Callable[[E], R]
    read: Callable[[dict[str, Any]], R]
    line: Callable[[R], str]


def claim(out: Path, settings: dict[str, Any]) -> None:
    """Write down, by label, what results depend on; or compare it with what the folder's do.

    Raises:
        InputError: the folder holds results of other settings.
    """
    out.mkdir(parents=True, exist_ok=True)
    file = out / SETTINGS
    known: dict[str, Any] = json.loads(file.read_text("utf-8")) if file.exists() else {}
    for label, plain in json.loads(json.dumps(settings, default=str)).items():
        if known.setdefault(label, plain) != plain:
            raise InputError(
                f"{out} holds results of other settings (see {SETTINGS}); choose another --out"
            )
    file.write_text(json.dumps(known, indent=2), "utf-8")


def fill(entries: Sequence[E], options: TableOptions, work: Work[E, R], tell: Tell) -> list[R]:
    """Make the runs that the table does not hold yet; all that were asked for, in that order.

    Raises:
        InputError: what stands in the folder is no such table.
    """
    options.out.mkdir(parents=True, exist_ok=True)
    wanted = {entry.key: entry for entry in entries}
    done = {key: row for key, row in rows_in(options.out, work).items() if key in wanted}
    if done:
        tell(f"{len(done)} of {len(wanted)} runs are in {options.out / TABLE} already")
    left = [entry for key, entry in wanted.items() if key not in done]
    seconds: list[float] = []
    with (options.out / TABLE).open("a", encoding="utf-8") as table:
        for row in _made(left, options.jobs, work.make):
            table.write(json.dumps(asdict(row)) + "\n")  # type: ignore[call-overload]
            table.flush()
            done[row.key] = row
            seconds.append(row.wall_seconds)
            to_go = mean(seconds) * (len(left) - len(seconds)) / options.jobs
            tell(f"{len(done):4d}/{len(wanted)}  {work.line(row)}{_to_go(to_go)}")
    return [done[key] for key in wanted]


def rows_in(folder: Path, work: Work[E, R]) -> dict[Key, R]:
    """The runs written down so far; a last line cut off by an interruption is run again.

    Raises:
        InputError: a line is none of this table.
    """
    rows: dict[Key, R] = {}
    file = folder / TABLE
    if not file.exists():
        return rows
    text = file.read_text("utf-8")
    whole = text[: text.rfind("\n") + 1]
    if whole != text:
        file.write_text(whole, "utf-8")
    for number, line in enumerate(whole.splitlines(), start=1):
        try:
            row = work.read(json.loads(line))
        except (ValueError, TypeError, KeyError) as error:
            mark = Mark(str(file), number)
            sentence = f"not a line of this table: {error}"
            raise InputError([Finding(mark, "E004", sentence, "choose another --out")]) from None
        rows[row.key] = row
    return rows


def _to_go(seconds: float) -> str:
    """Words for the time that the rest will take, if the runs to come are like those before."""
    if seconds < 1.0:
        return ""
    return f"; {seconds:.0f} s to go" if seconds < 90.0 else f"; {seconds / 60.0:.0f} min to go"


def _made(entries: Sequence[E], jobs: int, make: Callable[[E], R]) -> Iterator[R]:
    """The runs as they come to their ends."""
    if len(entries) < 2 or (jobs == 1 and len(entries) <= RUNS_PER_PROCESS):
        yield from map(make, entries)
        return
    pool = get_context("spawn").Pool(
        jobs, initializer=_leave_interrupts_to_the_parent, maxtasksperchild=RUNS_PER_PROCESS
    )
    try:
        yield from pool.imap_unordered(make, entries)
    finally:
        pool.terminate()
        pool.join()


def _leave_interrupts_to_the_parent() -> None:
    """Ctrl-C reaches every process of a terminal; the parent ends the others."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
