"""File of a rerun recording: complete messages only, up to a size limit.

rerun's own file sink holds an index of all chunks in memory until the end of the run, and does not
report a full disk. So the encoded messages are taken from rerun's memory stream and written here,
without the index, which `rerun rrd optimize` adds.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path

from stack.errors import TelemetryError
from stack.telemetry.recorder import write_all
from stack.telemetry.records import RecordFull

MAGIC = b"RRF2"
HEADER_BYTES = 12
"""A stream begins with MAGIC, its version and its options."""

END_OF_STREAM = 0
"""Kind of the message after which only the index follows."""

_MESSAGE = struct.Struct("<QQ")
"""Kind and length of a message, which precede its content."""


class RecordingFile:
    """Appends encoded messages to a file; a killed process leaves at most the last one incomplete.

    Args:
        path: of the file; replaced if it exists.
        limit: size that the file does not exceed, bytes.

    Raises:
        OSError: the file cannot be created.
    """

    def __init__(self, path: Path, limit: float) -> None:
        self._path, self._limit, self._size = path, limit, 0
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | os.O_CLOEXEC
        self._file = os.open(path, flags, 0o666)

    def append(self, stream: bytes) -> None:
        """Append the messages of an encoded stream, as rerun's memory stream returns it.

        Raises:
            RecordFull: they do not fit; nothing was written.
            OSError: they cannot be written, or the file was removed; the file ends before them.
            TelemetryError: this is not a stream of rerun.
        """
        wanted = b"".join(_messages(stream))
        if self._size == 0:
            wanted = stream[:HEADER_BYTES] + wanted
        if self._size + len(wanted) > self._limit:
            raise RecordFull(self._path.name, self._limit)
        write_all(self._file, wanted)
        self._size += len(wanted)

    def close(self) -> None:
        """Close the file. Safe to call twice."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1


def _messages(stream: bytes) -> Iterator[bytes]:
    """The messages of a stream with their kind and length, without header, end and index."""
    position = HEADER_BYTES
    while position < len(stream):
        if stream[:4] != MAGIC or position + _MESSAGE.size > len(stream):
            raise TelemetryError("this version of rerun encodes recordings in another format")
        kind, length = _MESSAGE.unpack_from(stream, position)
        if kind == END_OF_STREAM:
            return
        following = position + _MESSAGE.size + length
        yield stream[position:following]
        position = following
