"""Writer of snapshots.mcap: an MCAP file to which each record is appended as a whole."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

from stack.telemetry.lost_records import RecordFull
from stack.telemetry.recorder import write_all
from stack.telemetry.snapshots.format import (
    FORMAT,
    MAGIC,
    MESSAGE,
    MESSAGE_KIND,
    NANOSECONDS,
    TIMES,
    schemas,
)


class McapFile:
    """An MCAP file to which each record is appended as a whole or not at all.

    The library's own writer takes three times as long for a message.
    """

    def __init__(self, path: Path, limit: float) -> None:
        self._path, self._limit = path, limit
        self._number, self._count, self._size = -1, 0, 0
        self._compress: Callable[[Mapping[str, Any]], bytes] | None = None
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}

    def open(self) -> None:
        """Create the file with the schemas of its messages."""
        import msgpack
        import zstandard
        from mcap.records import Header, Metadata, Schema

        compressor = zstandard.ZstdCompressor(level=1)
        self._compress = lambda fields: compressor.compress(msgpack.packb(fields))
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | os.O_CLOEXEC
        self._number = os.open(self._path, flags, 0o666)
        self._append(
            Header("", f"treepilot {version('treepilot')}"),
            Metadata("treepilot", {"version": FORMAT}),
            before=MAGIC,
        )
        for number, (name, fields) in enumerate(schemas().items(), 1):
            self._schemas[name] = number
            self._append(Schema(number, json.dumps(fields).encode(), "treepilot", name))

    def write(self, topic: str, schema: str, time: float, fields: Mapping[str, Any]) -> None:
        """Append a message at a robot time, s.

        Raises:
            RecordFull: it does not fit; nothing was written.
            OSError: it cannot be written, or the file was removed.
        """
        if topic not in self._channels:
            self._channels[topic] = self._add_channel(topic, schema)
        stamp = max(0, round(time * NANOSECONDS))
        assert self._compress is not None, "opened"
        data = self._compress(fields)
        head = MESSAGE.pack(
            MESSAGE_KIND, TIMES + len(data), self._channels[topic], self._count, stamp, stamp
        )
        self._size += len(head) + len(data)
        if self._size > self._limit:
            raise RecordFull(self._path.name, self._limit)
        write_all(self._number, head + data)
        self._count += 1

    def close(self) -> None:
        """Write the end of the file if the disk has room; it is readable without. Safe twice."""
        from mcap.records import DataEnd, Footer

        if self._number >= 0:
            with suppress(OSError):
                self._append(DataEnd(0), Footer(0, 0, 0), after=MAGIC)
            os.close(self._number)
            self._number = -1

    def _add_channel(self, topic: str, schema: str) -> int:
        from mcap.records import Channel

        number = len(self._channels) + 1
        about = {"compression": "zstd"}
        self._append(Channel(number, topic, "msgpack", about, self._schemas[schema]))
        return number

    def _append(self, *records: Any, before: bytes = b"", after: bytes = b"") -> None:
        from mcap.data_stream import RecordBuilder

        builder: Any = RecordBuilder()
        for record in records:
            record.write(builder)
        write_all(self._number, before + builder.end() + after)
