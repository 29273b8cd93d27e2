"""The folder that a run leaves behind, and the sink that fills it."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from stack.errors import InputError, TelemetryError
from stack.telemetry.event_log import event_line, json_value
from stack.telemetry.records import Event, RunInfo, Snapshot


class RunFolder:
    """One run's folder.

        report.json    how it went            events.jsonl   what happened, one line each
        mission.yaml   what was asked for     log.txt        what was said while it ran
        mission.rrd    for rerun, if wanted   pictures/      what behaviours saved

    Attributes:
        path: the folder.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @staticmethod
    def create(path: Path, mission_text: str = "") -> RunFolder:
        """Make the folder and put a copy of the mission into it.

        Raises:
            InputError: there is something in the way, or it cannot be written.
        """
        try:
            path.mkdir(parents=True, exist_ok=True)
            if next(path.iterdir(), None) is not None:
                raise InputError(f"the run folder {path} is not empty; name another")
            folder = RunFolder(path)
            if mission_text:
                folder.write("mission.yaml", mission_text.encode())
        except FileExistsError:
            raise InputError(f"the run folder {path} is a file; name another") from None
        except OSError as error:
            raise InputError(f"cannot write the run folder {path}: {error.strerror}") from None
        return folder

    @property
    def events(self) -> Path:
        """One event a line."""
        return self.path / "events.jsonl"

    @property
    def report(self) -> Path:
        """How the run went."""
        return self.path / "report.json"

    @property
    def recording(self) -> Path:
        """What rerun shows."""
        return self.path / "mission.rrd"

    def write(self, name: str, content: bytes) -> str:
        """Write a small file whole or not at all; returns its name within the folder.

        Raises:
            InputError: the name leads out of the folder.
            OSError: it cannot be written.
        """
        target = self.path / name
        if not target.resolve().is_relative_to(self.path.resolve()):
            raise InputError(f"{name!r} is not inside the run folder")
        target.parent.mkdir(parents=True, exist_ok=True)
        unfinished = target.with_name(f".{target.name}.new")
        unfinished.write_bytes(content)
        unfinished.replace(target)
        return target.relative_to(self.path).as_posix()

    def log(self, line: str) -> None:
        """Add a line to log.txt; a full disk loses the line, never the mission."""
        with suppress(OSError), (self.path / "log.txt").open("a", encoding="utf-8") as file:
            file.write(line.rstrip("\n") + "\n")

    def read_report(self) -> dict[str, Any]:
        """The report of a finished run.

        Raises:
            TelemetryError: there is none, or it is not one.
        """
        try:
            report = json.loads(self.report.read_text(encoding="utf-8"))
        except OSError as error:
            raise TelemetryError(f"no report in {self.path}: {error.strerror}") from None
        except ValueError as error:
            raise TelemetryError(f"{self.report} is not a report: {error}") from None
        if not isinstance(report, dict):
            raise TelemetryError(f"{self.report} is not a report: expected a mapping")
        return report


class Recorder:
    """The sink that writes a run folder.

    Each event is one write of one whole line, so that a killed run leaves whole lines.
    """

    def __init__(self, folder: RunFolder) -> None:
        self.folder = folder
        self._file = -1

    def open(self, info: RunInfo) -> None:
        """Begin events.jsonl."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC
        self._file = os.open(self.folder.events, flags, 0o666)

    def event(self, event: Event) -> None:
        """Add an event.

        Raises:
            OSError: the disk takes no more.
        """
        line = event_line(event)
        written = os.write(self._file, line)
        while written < len(line):
            written += os.write(self._file, line[written:])

    def wants_snapshot(self, time: float) -> bool:
        """Never: everything worth keeping is an event."""
        return False

    def snapshot(self, snapshot: Snapshot) -> None:
        """Nothing to keep."""

    def close(self, report: Mapping[str, Any] | None) -> None:
        """End events.jsonl and write the report. Safe to call twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
        if report is not None:
            text = json.dumps(json_value(report), indent=2, ensure_ascii=False, allow_nan=False)
            self.folder.write("report.json", text.encode() + b"\n")
