"""Folder of a sweep: its description, its journal and its table.

    sweep.json       the whole design, digests of the inputs, versions
    journal.jsonl    one line a run, written as soon as it is over
    runs.parquet     the same as a table, in the order of the runs
    runs/            kept run folders

A killed sweep loses no run that is over: the table is made again from the journal.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import RawIOBase
from pathlib import Path
from typing import Any

from missions.bench.journal import cut_journal, read_journal
from missions.execution.resources import versions
from missions.sweeps.checking import CheckedSweep, file_differences
from missions.sweeps.row import SweepRow, columns
from missions.sweeps.sweep import Sweep
from stack.documents.files import JSON_BYTES, read_bytes
from stack.errors import InputError
from stack.telemetry.codec import MalformedError, codec_of

FORMAT = 1
DESCRIPTION, JOURNAL, TABLE, RUNS = "sweep.json", "journal.jsonl", "runs.parquet", "runs"

OTHER_OUT = "choose another --out"

JOURNAL_BYTES = 1 << 30
"""Largest journal that is read: about a million runs."""


def place_of(runs: Path, number: int) -> Path:
    """Return the place of the folder of a run.

    Args:
        runs: folder of the run folders.
        number: of the run.
    """
    return runs / f"{number:05d}"


class SweepFolder:
    """The folder of a sweep.

    Attributes:
        path: absolute.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.absolute()

    @property
    def runs(self) -> Path:
        """Folder of the kept run folders."""
        return self.path / RUNS

    @property
    def is_begun(self) -> bool:
        """Whether it holds a sweep."""
        return (self.path / DESCRIPTION).exists()

    @contextmanager
    def open_journal(self) -> Iterator[RawIOBase]:
        """Open the journal for further rows; a line that an interruption cut off is removed.

        It is locked until the end: two sweeps would mix their rows, and remove each other's runs.

        Raises:
            InputError: another sweep is running in the folder, or it holds something else.
        """
        file = self.path / JOURNAL
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            begun = (self.path / DESCRIPTION).exists()
            if not begun and any(one != file or one.stat().st_size for one in self.path.iterdir()):
                raise InputError(f"{self.path} is not empty and holds no sweep", OTHER_OUT)
            journal = file.open("ab", buffering=0)
        except OSError as error:
            raise _unwritten(file, error) from None
        with journal:
            try:
                fcntl.flock(journal, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(f"a sweep is running in {self.path}", OTHER_OUT) from None
            except OSError:
                pass  # a file system without locks
            cut_journal(file, JOURNAL_BYTES)
            yield journal

    def begin(self, checked: CheckedSweep) -> list[SweepRow]:
        """Describe the sweep, or compare it with the one in the folder; return the rows so far.

        Raises:
            InputError: the folder has another sweep, rows of another version, or is damaged.
        """
        if (self.path / DESCRIPTION).exists():
            self._compare(checked)
        content = {
            "format": FORMAT, **checked.sweep.plain(), "keep": checked.sweep.keep,
            "versions": versions(), "files": checked.files,
        }  # fmt: skip
        self._replace(DESCRIPTION, json.dumps(content, indent=2, ensure_ascii=False).encode())
        rows = self.rows(checked.sweep.runs)
        for row in rows:
            self._check_version(row.versions)
        return rows

    def sweep(self) -> Sweep:
        """Return the sweep that the folder describes.

        Raises:
            InputError: the folder has none, or is damaged.
        """
        return self._described()[0]

    def write(self, journal: RawIOBase, row: SweepRow) -> None:
        """Append a row to the journal.

        Raises:
            InputError: it cannot be written, e.g. because the disk is full; no row is lost.
        """
        line = json.dumps(row.plain(), ensure_ascii=False).encode() + b"\n"
        try:
            written = journal.write(line)
        except OSError as error:
            raise _unwritten(self.path / JOURNAL, error) from None
        if written != len(line):
            full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
            raise _unwritten(self.path / JOURNAL, full)

    def rows(self, runs: int) -> list[SweepRow]:
        """Read the first runs in the journal; each counts once, in the order of the numbers.

        Raises:
            InputError: a line is not a row.
        """
        every = read_journal(self.path / JOURNAL, "row of a sweep", JOURNAL_BYTES, SweepRow.read)
        rows = {row.number: row for row in reversed(every) if row.number < runs}
        return [rows[number] for number in sorted(rows)]

    def tabulate(self, rows: Sequence[SweepRow], sweep: Sweep) -> None:
        """Write the table; the one before is replaced as a whole.

        Raises:
            InputError: it cannot be written; the journal has all rows.
        """
        import pyarrow
        import pyarrow.parquet

        ordered = sorted(rows, key=lambda row: row.number)
        named = columns(ordered, sweep.factors)
        types = [pyarrow.field(name, _type_of(name, values)) for name, values in named.items()]
        table = pyarrow.table(named, schema=pyarrow.schema(types))
        new = self.path / f".{TABLE}.new"
        try:
            pyarrow.parquet.write_table(table, new)
            new.replace(self.path / TABLE)
        except OSError as error:
            new.unlink(missing_ok=True)
            raise _unwritten(self.path / TABLE, error) from None

    def _compare(self, checked: CheckedSweep) -> None:
        sweep, content = self._described()
        found = [
            *checked.sweep.differences(sweep), *file_differences(content["files"], checked.files)
        ]  # fmt: skip
        if found:
            raise InputError(f"{self.path} has another sweep: {'; '.join(found[:3])}", OTHER_OUT)
        self._check_version(content["versions"])

    def _check_version(self, before: Mapping[str, str]) -> None:
        found = [
            f"{name} {text} (now {now})"
            for name, now in versions().items() if (text := before.get(name, "unknown")) != now
        ]  # fmt: skip
        if found:
            raise InputError(
                f"{self.path} has runs made with {', '.join(found)}; runs of two versions cannot be"
                " compared",
                f"{OTHER_OUT}, or install the version before",
            )

    def _described(self) -> tuple[Sweep, dict[str, Any]]:
        file = self.path / DESCRIPTION
        if not file.exists():
            raise InputError(f"{self.path} holds no sweep: it lacks {DESCRIPTION}")
        try:
            content: dict[str, Any] = json.loads(read_bytes(file, JSON_BYTES))
            if content["format"] != FORMAT:
                raise InputError(f"{file} has the format {content['format']!r}; {FORMAT} is read")
            for name in ("files", "versions"):
                codec_of(dict[str, str]).decode(content[name])
            return Sweep.read(content), content
        except (ValueError, LookupError, TypeError, MalformedError) as error:
            raise InputError(
                f"{file} is damaged, or another version wrote it: {error!r:.100}", OTHER_OUT
            ) from None

    def _replace(self, name: str, content: bytes) -> None:
        new = self.path / f".{name}.new"
        try:
            new.write_bytes(content)
            new.replace(self.path / name)
        except OSError as error:
            new.unlink(missing_ok=True)
            raise _unwritten(self.path / name, error) from None


def _type_of(name: str, values: Sequence[Any]) -> Any:
    """Return the type of a column, also of one that has no value yet."""
    import pyarrow

    if name in ("collisions", "pushed_into", "recoveries", "replans"):
        return pyarrow.int64()
    if name == "is_repeatable":
        return pyarrow.bool_()
    known = next((value for value in values if value is not None), 0.0)
    kinds = {bool: pyarrow.bool_(), int: pyarrow.int64(), str: pyarrow.string()}
    return kinds.get(type(known), pyarrow.float64())


def _unwritten(file: Path, error: OSError) -> InputError:
    is_full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
    do = "free some space" if is_full else f"make the folder writable, or {OTHER_OUT}"
    return InputError(
        f"cannot write {file}: {error.strerror or error}; the rows before are kept",
        f"{do}, then run the command again to continue",
    )
