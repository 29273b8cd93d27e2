"""Reads events.jsonl by number, also while it is written."""

from __future__ import annotations

from array import array
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from stack.documents.files import RECORD_BYTES, open_regular
from stack.telemetry.event_log import event_of
from stack.telemetry.records import Event


class EventFile:
    """The events of events.jsonl by number; only where they are is held in memory."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._lines = array("Q")
        self._end = 0
        self._file: Any = None

    def before(self, end: int, count: int) -> tuple[Event, ...]:
        """The last events of those before a number."""
        return tuple(self.between(max(0, end - count), end))

    def between(self, first: int, end: int) -> list[Event]:
        """The events from `first` on that are before `end`."""
        if end > len(self._lines):
            self._follow()
        end = min(end, len(self._lines))
        if first >= end:
            return []
        self._file.seek(self._lines[first])
        return list(islice(self._read(first), end - first))

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()

    def _read(self, first: int) -> Iterator[Event]:
        for number, line in enumerate(iter(lambda: self._file.readline(RECORD_BYTES), b""), first):
            yield event_of(line, f"{self._path}:{number + 1}")

    def _follow(self) -> None:
        """Note where the new lines are."""
        if self._file is None:
            try:
                self._file = open_regular(self._path)
            except OSError:
                return
        self._file.seek(self._end)
        while line := self._file.readline(RECORD_BYTES):
            if not line.endswith(b"\n"):
                break
            self._lines.append(self._end)
            self._end += len(line)
