"""File of a rerun recording.

rerun's own file sink waits for ever after an error of the disk. So the encoded messages are taken
from rerun's memory stream and written here, without the index, which `rerun rrd optimize` adds.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from pathlib import Path

from stack.errors import TelemetryError
from stack.telemetry.recorder import write_all

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

    Raises:
        OSError: the file cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self._is_empty = True
        flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND | os.O_CLOEXEC
        self._file = os.open(path, flags, 0o666)

    def append(self, stream: bytes) -> None:
        """Append the messages of an encoded stream, as rerun's memory stream returns it.

        Raises:
            OSError: they cannot be written, or the file was removed; the file ends before them.
            TelemetryError: this is not a stream of rerun.
        """
        wanted = b"".join(_messages(stream))
        if self._is_empty:
            wanted = stream[:HEADER_BYTES] + wanted
        write_all(self._file, wanted)
        self._is_empty = False

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
