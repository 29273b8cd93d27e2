"""Run folder and the sink that writes it."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import stat
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from stack.errors import InputError
from stack.telemetry.event_log import event_line, json_value
from stack.telemetry.hub import EVENTS, SENSORS, SNAPSHOTS, reason_of
from stack.telemetry.records import Event, RunInfo
from stack.telemetry.sinks import Sink


class RunFolder:
    """The folder of one run.

        report.json    result of the run      events.jsonl   events, one per line
        mission.yaml   copy of the mission    log.txt        lines printed during the run
        snapshots.mcap what could be seen     pictures/      pictures saved by behaviours
        sensors.mcap   sensor log             mission.rrd    drawn from the snapshots for rerun

    Attributes:
        path: the folder, absolute: a plugin may change the working directory.
        on_loss: called with a file and the reason when it could not be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path.absolute()
        self.on_loss: Callable[[str, str], None] = _ignore

    @staticmethod
    def create(path: Path, mission_text: str = "") -> RunFolder:
        """Create the folder and write a copy of the mission into it.

        Raises:
            InputError: the folder is not empty, is a file, or cannot be written.
        """
        try:
            path.mkdir(parents=True, exist_ok=True)
            if next(path.iterdir(), None) is not None:
                raise InputError(f"the run folder {path} is not empty; choose another")
            (path / "log.txt").touch(exist_ok=False)  # of two runs that begin at once, one fails
            folder = RunFolder(path)
            if mission_text:
                folder.write("mission.yaml", mission_text.encode())
        except FileExistsError:
            problem = "not empty" if path.is_dir() else "a file"
            raise InputError(f"the run folder {path} is {problem}; choose another") from None
        except OSError as error:
            raise InputError(f"cannot write the run folder {path}: {error.strerror}") from None
        return folder

    @property
    def events(self) -> Path:
        """Path of events.jsonl: one event per line."""
        return self.path / EVENTS

    @property
    def report(self) -> Path:
        """Path of report.json."""
        return self.path / "report.json"

    @property
    def recording(self) -> Path:
        """Path of the recording for rerun, which is drawn when it is asked for."""
        return self.path / "mission.rrd"

    @property
    def snapshots(self) -> Path:
        """Path of the recorded snapshots."""
        return self.path / SNAPSHOTS

    @property
    def sensors(self) -> Path:
        """Path of the sensor log."""
        return self.path / SENSORS

    def write(self, name: str, content: bytes) -> str:
        """Write a small file atomically and return its path relative to the folder.

        Raises:
            InputError: the name points outside the folder.
            OSError: the file cannot be written.
        """
        target = self.path / name
        if not target.resolve().is_relative_to(self.path.resolve()):
            raise InputError(f"{name!r} is not inside the run folder")
        target.parent.mkdir(parents=True, exist_ok=True)
        unfinished = target.with_name(f".{target.name}.new")
        try:
            unfinished.write_bytes(content)
            unfinished.replace(target)
        except OSError:
            unfinished.unlink(missing_ok=True)
            raise
        return target.relative_to(self.path).as_posix()

    def log(self, line: str) -> None:
        """Append a line to log.txt; a full disk loses the line but does not end the mission."""
        try:
            with (self.path / "log.txt").open("a", encoding="utf-8") as file:
                file.write(line.rstrip("\n") + "\n")
        except OSError as error:
            self.on_loss("log.txt", reason_of(error))

    def write_report(self, report: Mapping[str, Any]) -> None:
        """Write report.json.

        Raises:
            OSError: it cannot be written.
        """
        text = json.dumps(json_value(report), indent=2, ensure_ascii=False, allow_nan=False)
        self.write("report.json", text.encode() + b"\n")


def write_all(file: int, content: bytes) -> None:
    """Append to a file, all or nothing, in several parts if the system takes only a part.

    Raises:
        OSError: it cannot be written, or the file was removed.
    """
    before = os.fstat(file)
    if stat.S_ISREG(before.st_mode) and before.st_nlink == 0:
        raise OSError(errno.ENOENT, "the file was removed")
    try:
        written = os.write(file, content)
        while written < len(content):
            written += os.write(file, content[written:])
    except OSError:
        with suppress(OSError):
            os.ftruncate(file, before.st_size)
        raise


def _ignore(record: str, reason: str) -> None:
    """Default of `RunFolder.on_loss`: there is nobody to tell."""


class Recorder(Sink):
    """Sink that writes the events of a run into its folder.

    Each event is one write of one complete line, so that a killed run leaves complete lines.
    """

    def __init__(self, folder: RunFolder) -> None:
        self.folder = folder
        self._file = -1

    record = EVENTS

    def open(self, info: RunInfo) -> None:
        """Create events.jsonl and lock it, which shows that the run is live."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC
        self._file = os.open(self.folder.events, flags, 0o666)
        with suppress(OSError):  # a file system without locks
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)

    def event(self, event: Event) -> None:
        """Append an event.

        Raises:
            OSError: it cannot be written: the disk is full, or the file was removed.
        """
        write_all(self._file, event_line(event))

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Close events.jsonl. Safe to call twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
