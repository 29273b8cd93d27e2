"""`treepilot runs`: lists and deletes run folders."""

from __future__ import annotations

import fcntl
import json
import os
import shutil
import stat
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from stack.columns import columns
from stack.documents.files import JSON_BYTES, read_bytes
from stack.errors import InputError
from stack.parameters import suggestion
from stack.telemetry.hub import EVENTS
from stack.types.printable import printable

LIVE, INCOMPLETE = "live", "incomplete"
TAIL_BYTES = 1 << 16
"""Part of events.jsonl that is searched for the last event; longer events do not occur."""


MAX_TITLE = 100
"""Longest title and status that are read from a report, characters."""


@dataclass(frozen=True, slots=True)
class RunFolderEntry:
    """A run folder.

    Attributes:
        name: of the folder.
        mission: title of the mission; the folder's name if there is no report.
        status: of the report; `live` while it runs; `incomplete` if it ended without one.
        started: ISO 8601, local time.
        simulated_seconds: robot time at the end, or of the last event.
        size: of all files, bytes.
    """

    name: str
    mission: str
    status: str
    started: str
    simulated_seconds: float
    size: int

    def plain(self) -> dict[str, Any]:
        """Return JSON-compatible values."""
        return asdict(self)


def find_runs(parent: Path) -> list[RunFolderEntry]:
    """Return the runs in a folder, newest first.

    A run folder contains events.jsonl and mission.yaml. Symbolic links are not followed.

    Raises:
        InputError: the folder cannot be read.
    """
    if not parent.exists():
        return []
    try:
        folders = [item for item in parent.iterdir() if is_run_folder(item)]
    except OSError as error:
        raise InputError(f"cannot read {parent}: {error.strerror}") from None
    entries = []
    for folder in folders:
        with suppress(OSError):  # another process deletes it, or it cannot be read
            entries.append(_entry(folder))
    return sorted(entries, key=lambda run: (run.started, run.name), reverse=True)


NEWEST = "newest"


def find_run(name: str, parent: Path) -> Path:
    """Return a run folder by path, by its name in a folder of runs, or the newest one of it.

    Raises:
        InputError: there is no run in the folder, or `name` is neither its name nor a path.
    """
    if name != NEWEST:
        folder = Path(name) if Path(name).exists() else parent / name
        if not folder.is_dir():
            known = [run.name for run in find_runs(parent)]
            raise InputError(f"there is no run {name!r:.200}; {suggestion(name, known)}")
        return folder
    runs = find_runs(parent)
    if not runs:
        raise InputError(f"there is no run in {parent.absolute()}; give the path of a run folder")
    return parent / runs[0].name


def is_run_folder(folder: Path) -> bool:
    """Whether a path is a folder, no link, with the files that every run has."""
    return _is_kind(folder, stat.S_ISDIR) and all(
        _is_kind(folder / name, stat.S_ISREG) for name in (EVENTS, "mission.yaml")
    )


def is_live(folder: Path) -> bool:
    """Whether a run is live."""
    with suppress(OSError), _is_over(folder) as is_over:
        return not is_over
    return False


def chosen_runs(runs: Sequence[RunFolderEntry], names: Iterable[str]) -> list[RunFolderEntry]:
    """Return the runs with these names.

    Raises:
        InputError: there is no such run, or it is live.
    """
    known = {run.name: run for run in runs}
    chosen = []
    for name in dict.fromkeys(names):
        run = known.get(name)
        if run is None:
            raise InputError(f"no run {name!r}; {suggestion(name, known)}")
        if run.status == LIVE:
            raise InputError(f"{name} is live; end it first")
        chosen.append(run)
    return chosen


def older_than_newest(runs: Sequence[RunFolderEntry], count: int) -> list[RunFolderEntry]:
    """Return all but the newest `count` of the runs, newest first; live ones are left out."""
    return [run for run in runs[count:] if run.status != LIVE]


def delete_run(parent: Path, name: str) -> None:
    """Delete a run folder. Links in it are removed, not followed.

    Raises:
        InputError: it is not a run folder, it is live, or it cannot be deleted.
    """
    folder = parent / name
    if Path(name).name != name or not is_run_folder(folder):
        raise InputError(f"{folder} is not a run folder; it was not deleted")
    with _is_over(folder) as is_over:
        if not is_over:
            raise InputError(f"{name} is live; it was not deleted")
        try:
            shutil.rmtree(folder)
        except OSError as error:
            raise InputError(f"cannot delete {folder}: {error.strerror}") from None


def table(runs: Sequence[RunFolderEntry]) -> list[str]:
    """Return a line for each run, with a heading, and a line with the sum."""
    heading = ("RUN", "MISSION", "STATUS", "STARTED", "SIMULATED", "SIZE")
    rows = [
        (
            *map(_cell, (run.name, run.mission, run.status)), run.started.replace("T", " "),
            f"{run.simulated_seconds:.1f} s", size_text(run.size),
        )
        for run in runs
    ]  # fmt: skip
    total = size_text(sum(run.size for run in runs))
    return [
        *columns([heading, *rows], right=(4, 5)),
        f"{len(runs)} run{'' if len(runs) == 1 else 's'}, {total}",
    ]


def _cell(text: str) -> str:
    """Return a text of a file, which may be foreign, as one line for a terminal."""
    return printable(text).replace("\n", "\\n").replace("\t", "\\t")


def size_text(size: int) -> str:
    """Return a size in kB, MB or GB."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6)):
        if size >= factor:
            return f"{size / factor:.1f} {unit}"
    return f"{size / 1e3:.1f} kB"


def _entry(folder: Path) -> RunFolderEntry:
    report = _report(folder)
    with _is_over(folder) as is_over:
        status = str(report.get("status", INCOMPLETE))[:MAX_TITLE] if is_over else LIVE
    time = report.get("simulated_seconds")
    started = datetime.fromtimestamp((folder / "mission.yaml").stat().st_mtime)
    return RunFolderEntry(
        name=folder.name,
        mission=str(report.get("mission", folder.name))[:MAX_TITLE],
        status=status,
        started=started.isoformat(timespec="seconds"),
        simulated_seconds=float(time) if isinstance(time, int | float) else _last_time(folder),
        size=_size(folder),
    )


def _report(folder: Path) -> dict[str, Any]:
    """The report; empty if there is none or it is damaged."""
    try:
        report = json.loads(read_bytes(folder / "report.json", JSON_BYTES))
    except (OSError, ValueError, RecursionError):
        return {}
    return report if isinstance(report, dict) else {}


def _last_time(folder: Path) -> float:
    """Robot time of the last complete event, seconds; 0 if there is none."""
    with (folder / EVENTS).open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - TAIL_BYTES))
        lines = file.read().split(b"\n")[:-1]
    for line in reversed(lines):
        with suppress(ValueError, TypeError, KeyError, RecursionError):
            return float(json.loads(line)["time"])
    return 0.0


@contextmanager
def _is_over(folder: Path) -> Iterator[bool]:
    """Yield whether a run is over: its engine locks the file of its events while it runs."""
    with (folder / EVENTS).open("rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
            return
        except OSError:  # a file system without locks
            pass
        yield True


def _size(folder: Path) -> int:
    total = 0
    for base, _, files in os.walk(folder):
        for name in files:
            with suppress(OSError):
                total += (Path(base) / name).lstat().st_size
    return total


def _is_kind(path: Path, is_kind: Any) -> bool:
    try:
        return bool(is_kind(path.lstat().st_mode))
    except OSError:
        return False
