"""Resumable table of runs: filled by several processes, written row by row."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from statistics import mean
from typing import Any

from missions.bench.bench import Bench, E, Key, Options, R
from missions.bench.journal import cut_journal, read_journal
from missions.bench.processes import Alive, ProcessEnded, bounded, results
from stack.documents.files import JSON_BYTES, read_bytes
from stack.errors import InputError

TABLE, SETTINGS = "runs.jsonl", "settings.json"

RUNS_PER_PROCESS = 40
"""PyBullet frees meshes, about 10 MB per world, only at the end of the process."""

Log = Callable[[str], None]


def measured(bench: Bench[E, R], options: Options, log: Log) -> list[R]:
    """Make the runs of a bench that are missing in the table; return all.

    Raises:
        InputError: a mission or an option has errors, two runs have the same key, or the folder
            has results of other settings.
    """
    entries = bench.entries(options)
    key, count = Counter(entry.key for entry in entries).most_common(1)[0] if entries else ((), 1)
    if count > 1:
        what = ", ".join(map(str, key))
        raise InputError(f"{count} runs have the name {what}: give their files different names")
    first = {entry.label: entry for entry in reversed(entries)}
    settings = {label: bench.settings(entry) for label, entry in first.items()}
    record_settings(options.out, settings)
    return fill(bench, entries, options, log)


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


def fill(bench: Bench[E, R], entries: Sequence[E], options: Options, log: Log) -> list[R]:
    """Make the runs that are missing in the table; return all rows, in the order of the entries.

    Args:
        bench: of the table.
        entries: runs.
        options: folder of the table, and number of processes.
        log: receives lines of progress.

    Raises:
        InputError: the file in the folder is not a table of such rows.
    """
    options.out.mkdir(parents=True, exist_ok=True)
    wanted = {entry.key: entry for entry in entries}
    done = {key: row for key, row in rows_in(options.out, bench.rows).items() if key in wanted}
    if done:
        log(f"{len(done)} of {len(wanted)} runs are already in {options.out / TABLE}")
    missing = [entry for key, entry in wanted.items() if key not in done]
    seconds: list[float] = []
    with (options.out / TABLE).open("a", encoding="utf-8") as table:
        for row in _rows(bench, missing, options):
            table.write(json.dumps(asdict(row)) + "\n")  # type: ignore[call-overload]
            table.flush()
            done[row.key] = row
            seconds.append(row.wall_seconds)
            remaining = mean(seconds) * (len(missing) - len(seconds)) / options.jobs
            log(f"{len(done):4d}/{len(wanted)}  {row.line}{_remaining(remaining)}")
    return [done[key] for key in wanted]


def rows_in(folder: Path, kind: type[R]) -> dict[Key, R]:
    """Read the rows of a table; drop a last line cut off by an interruption.

    Raises:
        InputError: a line is not a row of this table.
    """
    file = folder / TABLE
    if file.exists():
        cut_journal(file, JSON_BYTES)
    return {row.key: row for row in read_journal(file, "row of this table", JSON_BYTES, kind.read)}


def _remaining(seconds: float) -> str:
    """Return the estimated remaining time as text."""
    if seconds < 1.0:
        return ""
    return f"; {seconds:.0f} s left" if seconds < 90.0 else f"; {seconds / 60.0:.0f} min left"


def _rows(bench: Bench[E, R], entries: Sequence[E], options: Options) -> Iterator[R]:
    """Yield the rows in the order in which the runs finish."""
    make = partial(bench.row, out=options.out)
    if len(entries) < 2 or (options.jobs == 1 and len(entries) <= RUNS_PER_PROCESS):
        for entry in entries:
            with bounded():
                row = make(entry)
            yield row
        return
    start = partial(_maker, make)
    for entry, result in results(start, entries, options.jobs, RUNS_PER_PROCESS):
        if isinstance(result, ProcessEnded):
            yield bench.rows.crashed(entry.key, result.reason)
        elif isinstance(result, BaseException):
            raise result
        else:
            yield result


def _maker(make: Callable[[E], R], _: Alive) -> Callable[[E], R]:
    """Return what makes the rows in a process; benches have no other limit than LONGEST_RUN."""
    return make
