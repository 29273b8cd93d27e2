"""Reads the messages of snapshots.mcap, also while it is written."""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from io import BytesIO
from pathlib import Path
from typing import Any, TypeVar

from stack.documents.files import RECORD_BYTES, open_regular
from stack.errors import InputError
from stack.telemetry.codec import Codec, MalformedError, field_codecs
from stack.telemetry.records import Layer, RunInfo, Snapshot
from stack.telemetry.snapshots.format import (
    FORMAT,
    MAGIC,
    MESSAGE,
    MESSAGE_KIND,
    NANOSECONDS,
    ROWS,
    recorded_fields,
    schemas,
)
from stack.telemetry.snapshots.picture_codes import EncodedPicture
from stack.types import CameraModel

T = TypeVar("T")

_RECORD = struct.Struct("<BQ")
"""Kind and length of an MCAP record."""

_SCHEMA, _CHANNEL, _METADATA, _DATA_END = 0x03, 0x04, 0x0C, 0x0F


@dataclass(frozen=True, slots=True)
class Entry:
    """Where a message is.

    Attributes:
        topic: of the message.
        time: robot's clock, seconds.
        place: byte of the file.
    """

    topic: str
    time: float
    place: int


class MessageFile:
    """The messages of a file; none of them is held in memory.

    Args:
        path: of the file.

    Raises:
        InputError: it is no MCAP file.
        OSError: it cannot be opened.

    Attributes:
        path: of the file.
        is_complete: whether the end of the file is written and was read.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.is_complete = path, False
        self._file = open_regular(path)
        self._position = len(MAGIC)
        self._topics: dict[int, str] = {}
        self._readable: dict[str, dict[str, Codec]] = {}
        self._decompress = _decompressor()
        if self._file.read(len(MAGIC)) != MAGIC:
            self.close()
            raise InputError(f"{path} is not a recording: it is not an MCAP file")

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def follow(self) -> Iterator[Entry]:
        """Yield the messages that were written since the last call.

        Raises:
            InputError: the file is damaged, or of another format.
        """
        size = os.fstat(self._file.fileno()).st_size
        while not self.is_complete and self._position + _RECORD.size <= size:
            place = self._position
            self._file.seek(place)
            head = self._file.read(MESSAGE.size)
            kind, length = _RECORD.unpack_from(head)
            if length > RECORD_BYTES:
                raise self.damaged(f"a record of {length} bytes at byte {place}")
            if place + _RECORD.size + length > size:  # its end is not written yet
                break
            if kind in (_SCHEMA, _CHANNEL, _METADATA):
                self._describe(kind, length)
            self._position += _RECORD.size + length
            self.is_complete = kind == _DATA_END
            if kind == MESSAGE_KIND and length >= MESSAGE.size - _RECORD.size:
                _, _, channel, _, stamp, _ = MESSAGE.unpack(head)
                yield Entry(self._topics.get(channel, ""), stamp / NANOSECONDS, place)

    def message(self, place: int) -> dict[str, Any]:
        """Return the content of the message at a place of the file.

        Raises:
            InputError: the file is damaged.
        """
        self._file.seek(place)
        head = self._file.read(MESSAGE.size)
        _, length, *_ = MESSAGE.unpack(head)
        data = self._file.read(length - (MESSAGE.size - _RECORD.size))
        try:
            content = self._decompress(data)
        except ValueError as error:
            raise self.damaged(f"the message at byte {place}: {error}") from None
        if not isinstance(content, dict):
            raise self.damaged(f"the message at byte {place} is not a mapping")
        return content

    def codecs(self, kind: str) -> Mapping[str, Codec]:
        """The codecs of the fields of a kind of message that can be read, by name."""
        return self._readable.get(kind, {})

    def decoded(self, codec: Codec, value: Any, kind: str) -> Any:
        """Decode the value of a field of a message.

        Raises:
            InputError: the file is damaged.
        """
        try:
            return codec.decode(value)
        except (MalformedError, TypeError, ValueError, OverflowError) as error:
            raise self.damaged(f"a malformed {kind}: {error}") from None

    def record(self, make: Callable[..., T], content: Mapping[str, Any], kind: str) -> T:
        """Make a record of the fields of a message.

        Raises:
            InputError: the file is damaged.
        """
        found = {
            name: self.decoded(codec, content[name], kind)
            for name, codec in self.codecs(kind).items()
            if name in content
        }
        try:
            return make(**found)
        except (TypeError, ValueError) as error:
            raise self.damaged(str(error)) from None

    def damaged(self, what: str) -> InputError:
        """The error of a damaged file."""
        return InputError(f"{self.path} is damaged: {what}")

    def _describe(self, kind: int, length: int) -> None:
        """Read a record that says what the messages are."""
        from mcap.data_stream import ReadDataStream
        from mcap.exceptions import McapError
        from mcap.records import Channel, Metadata, Schema

        self._file.seek(self._position + _RECORD.size)
        content = BytesIO(self._file.read(length))
        try:
            stream = ReadDataStream(content)
            if kind == _CHANNEL:
                channel = Channel.read(stream)
                self._topics[channel.id] = channel.topic
            elif kind == _METADATA:
                self._refuse_format(Metadata.read(stream).metadata.get("version", ""))
            else:
                schema = Schema.read(stream)
                self._readable[schema.name] = self._known(schema.name, json.loads(schema.data))
        except (McapError, struct.error, ValueError, AttributeError, TypeError) as error:
            raise self.damaged(str(error)) from None

    def _refuse_format(self, version: str) -> None:
        if version != FORMAT:
            raise InputError(
                f"{self.path} has the format {version:.20}, this version of treepilot reads"
                f" {FORMAT}; open it with the version that recorded it (report.json names it)"
            )

    def _known(self, kind: str, written: Mapping[str, str]) -> dict[str, Codec]:
        """The codecs of the fields that mean what they mean in this version."""
        current = schemas().get(kind, {})
        known = {name for name, shape in written.items() if _reads(current.get(name, ""), shape)}
        required, codecs = _FIELDS.get(kind, (frozenset[str](), dict[str, Codec]()))
        lacking = sorted(required - known)
        if lacking:
            raise InputError(
                f"{self.path} was recorded by a version of treepilot whose {', '.join(lacking)} of"
                f" a {kind} is not what it is in this version; open it with that version"
                " (report.json names it)"
            )
        return {name: codec for name, codec in codecs.items() if name in known}


def _reads(current: str, written: str) -> bool:
    """Whether a type reads what was written with a type: the same, or a union with new members."""
    return current == written or current.startswith(f"{written}|")


def _decompressor() -> Callable[[bytes], Any]:
    """Return what decodes the data of a message; it raises ValueError."""
    import msgpack
    import zstandard

    decompressor = zstandard.ZstdDecompressor()

    def decompress(data: bytes) -> Any:
        try:
            plain = decompressor.decompress(data, max_output_size=RECORD_BYTES)
            return msgpack.unpackb(plain, raw=False, strict_map_key=True)
        except (zstandard.ZstdError, msgpack.UnpackException) as error:
            raise ValueError(str(error)) from None

    return decompress


def _required(kind: type) -> frozenset[str]:
    """Names of the fields without a default."""
    return frozenset(
        item.name
        for item in fields(kind)
        if item.default is MISSING and item.default_factory is MISSING
    )


_FIELDS: dict[str, tuple[frozenset[str], Mapping[str, Codec]]] = {
    "RunInfo": (_required(RunInfo), field_codecs(RunInfo)),
    "Snapshot": (_required(Snapshot) | {ROWS}, recorded_fields()),
    "Layer": (_required(Layer), field_codecs(Layer)),
    "Picture": (_required(EncodedPicture), field_codecs(EncodedPicture)),
    "Camera": (_required(CameraModel), field_codecs(CameraModel)),
}
"""Fields that a reader cannot do without, and the codecs of all, by kind of record."""
