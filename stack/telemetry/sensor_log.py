"""Sensor log: all observations of a run, lossless, in an MCAP file.

Each sensor is a channel; a message is one measurement as a msgpack mapping of its fields. Arrays
are mappings with `dtype`, `shape` and the bytes in `data`, so that floats are kept bit for bit. The
messages of one observation have the same sequence number; `log_time` is the body's clock in
nanoseconds. Messages are written at once, without chunks: the file of a killed run can be read up
to its last complete message. The format is described at https://mcap.dev.
"""

from __future__ import annotations

import dataclasses
import errno
import os
import stat
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, BinaryIO, Union, get_args, get_origin, get_type_hints

import msgpack
import numpy as np

from stack.documents.files import RECORD_BYTES, open_regular
from stack.errors import BodyError, InputError
from stack.parameters import values_of
from stack.telemetry.record_types import record_type
from stack.types import Measurement, Observation

VERSION = "1"
NANOSECONDS = 1e9


class SensorLog:
    """Writes observations to an MCAP file.

    Args:
        path: of the file; replaced if it exists.
        about: texts about the run (mission, robot, seed), stored as metadata.

    Raises:
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path, about: dict[str, str]) -> None:
        from mcap.writer import CompressionType, Writer

        self._file: BinaryIO = path.open("wb")
        self._writer = Writer(self._file, compression=CompressionType.NONE, use_chunking=False)
        self._writer.start(library="treepilot")
        self._writer.add_metadata("treepilot", {"version": VERSION, **about})
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._count = 0

    def write(self, observation: Observation) -> None:
        """Append an observation.

        Raises:
            OSError: the disk is full, or the file was removed.
            BodyError: a measurement is of a type that no package registers: it could not be read.
        """
        for name, measurement in observation.measurements.items():
            fields = {"time": observation.time, **_plain(measurement)}
            self._writer.add_message(
                self._channel(name, measurement),
                log_time=round(observation.time * NANOSECONDS),
                publish_time=max(0, round(measurement.stamp * NANOSECONDS)),
                sequence=self._count,
                data=msgpack.packb(fields),
            )
        self._count += 1
        self._file.flush()
        found = os.fstat(self._file.fileno())
        if stat.S_ISREG(found.st_mode) and found.st_nlink == 0:
            raise OSError(errno.ENOENT, "the file was removed")

    def close(self) -> None:
        """Write the index if the disk has room; the log is readable without it. Safe twice."""
        if not self._file.closed:
            with suppress(OSError):
                self._writer.finish()  # type: ignore[no-untyped-call]
            with suppress(OSError):
                self._file.close()

    def _channel(self, name: str, measurement: Measurement) -> int:
        if name not in self._channels:
            kind = type(measurement).__name__
            self._check(name, type(measurement))
            if kind not in self._schemas:
                doc = (type(measurement).__doc__ or "").encode()
                self._schemas[kind] = self._writer.register_schema(kind, "text", doc)
            self._channels[name] = self._writer.register_channel(
                topic=f"/{name}", message_encoding="msgpack", schema_id=self._schemas[kind]
            )
        return self._channels[name]

    def _check(self, sensor: str, kind: type) -> None:
        try:
            registered = record_type(kind.__name__)
        except InputError as error:
            raise BodyError(f"the sensor {sensor} cannot be recorded: {error}") from error
        if registered is not kind:
            raise BodyError(
                f"the sensor {sensor} cannot be recorded: {kind.__module__} and "
                f"{registered.__module__} have types of measurements {kind.__name__!r}"
            )


def is_sensor_log(path: Path) -> bool:
    """Return whether a file is an MCAP file that treepilot has written, complete or not.

    Raises:
        InputError: the file cannot be read, or is damaged at its beginning.
    """
    from mcap.records import Header

    with _opened(path) as file:
        first = next(_records(_reader(file), path), None)
    return isinstance(first, Header) and first.library.startswith("treepilot")


def read_about(path: Path) -> dict[str, str]:
    """Return the metadata that the log was created with.

    Raises:
        InputError: the file is missing or not a sensor log.
    """
    from mcap.records import Metadata

    with _opened(path) as file:
        for record in _records(_reader(file), path):
            if isinstance(record, Metadata) and record.name == "treepilot":
                return dict(record.metadata)
    raise InputError(f"{path} is not a sensor log of treepilot: it has no metadata")


def read_observations(path: Path) -> Iterator[Observation]:
    """Return the observations in order.

    A message that was cut off by the end of the process ends the log.

    Raises:
        InputError: the file is missing, not a sensor log, or damaged, or has measurements of a type
            that no package registers.
    """
    from mcap.records import Channel, Message, Schema

    schemas: dict[int, str] = {}
    channels: dict[int, tuple[str, str]] = {}
    sequence, time = -1, 0.0
    measurements: dict[str, Measurement] = {}
    with _opened(path) as file:
        for record in _records(_reader(file), path):
            if isinstance(record, Schema):
                schemas[record.id] = record.name
            elif isinstance(record, Channel):
                channels[record.id] = record.topic.lstrip("/"), schemas.get(record.schema_id, "")
            elif isinstance(record, Message):
                if record.sequence != sequence and measurements:
                    yield Observation(time, measurements)
                    measurements = {}
                sequence = record.sequence
                try:
                    name, kind = channels[record.channel_id]
                    fields = msgpack.unpackb(record.data)
                    time = _read(fields.pop("time"), float)
                    measurements[name] = _read(fields, record_type(kind))
                except (LookupError, TypeError, ValueError, AttributeError) as error:
                    raise InputError(
                        f"{path}: the message after {time:g} s is damaged: {error!r:.100}"
                    ) from None
    if measurements:
        yield Observation(time, measurements)


class _Bounded:
    """A file from which at most RECORD_BYTES are read at once: a length may be damaged."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file

    def read(self, size: int) -> bytes:
        """As of a file; ValueError if the size is above RECORD_BYTES."""
        if not 0 <= size <= RECORD_BYTES:
            raise ValueError(f"a record of {size} bytes; at most {RECORD_BYTES} are read")
        return self._file.read(size)


def _opened(path: Path) -> BinaryIO:
    try:
        return open_regular(path)
    except OSError as error:
        raise InputError(f"cannot read the sensor log {path}: {error.strerror}") from None


def _reader(file: BinaryIO) -> Any:
    from mcap.stream_reader import StreamReader

    bounded: Any = _Bounded(file)
    return StreamReader(bounded, emit_chunks=True)


def _records(reader: Any, path: Path) -> Iterator[Any]:
    from mcap.exceptions import EndOfFile, InvalidMagic, McapError
    from mcap.records import Chunk
    from mcap.stream_reader import breakup_chunk

    found = False
    try:
        for record in reader.records:
            found = True
            if isinstance(record, Chunk):
                yield from breakup_chunk(_unpacked(record))
            else:
                yield record
    except InvalidMagic:
        raise InputError(f"{path} is not a sensor log: it is not an MCAP file") from None
    except EndOfFile:
        if not found:
            raise InputError(f"{path} is not a sensor log: it is too short") from None
    except (McapError, struct.error, ValueError) as error:
        raise InputError(f"{path} is not a sensor log: {error}") from None


def _unpacked(chunk: Any) -> Any:
    """A chunk without compression; other programs write them.

    Raises:
        ValueError: its content is damaged or larger than RECORD_BYTES.
    """
    import lz4.frame
    import zstandard

    content = chunk.data
    try:
        if chunk.compression == "zstd":
            content = zstandard.ZstdDecompressor().stream_reader(content).read(RECORD_BYTES + 1)
        elif chunk.compression == "lz4":
            content = lz4.frame.LZ4FrameDecompressor().decompress(content, RECORD_BYTES + 1)
    except (zstandard.ZstdError, RuntimeError) as error:
        raise ValueError(f"a damaged chunk: {error}") from None
    if len(content) > RECORD_BYTES:
        raise ValueError(f"a chunk of more than {RECORD_BYTES} bytes")
    return dataclasses.replace(chunk, compression="", data=content)


def _plain(value: Any) -> Any:
    """Convert a measurement to mappings, numbers and texts."""
    if dataclasses.is_dataclass(value):
        return {name: _plain(item) for name, item in values_of(value).items()}
    if isinstance(value, np.ndarray):
        return {"dtype": value.dtype.str, "shape": value.shape, "data": value.tobytes()}
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    return value


def _read(value: Any, kind: Any) -> Any:
    """Convert plain values back to a type."""
    if get_origin(kind) in (Union, UnionType):
        if value is None:
            return None
        kind = next(item for item in get_args(kind) if item is not NoneType)
    if isinstance(kind, type) and dataclasses.is_dataclass(kind):
        hints = get_type_hints(kind)
        return kind(**{name: _read(value[name], hints[name]) for name in hints if name in value})
    if kind in (bool, int, float, str):
        return _scalar(value, kind)
    if isinstance(value, dict):
        array = np.frombuffer(value["data"], np.dtype(value["dtype"])).reshape(value["shape"])
        return array.copy()
    return tuple(value) if isinstance(value, list) else value


def _scalar(value: Any, kind: type) -> Any:
    """A number or text of the expected type.

    Raises:
        TypeError: it is of another type.
    """
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    if type(value) is not kind:
        raise TypeError(f"expected {kind.__name__}, got {type(value).__name__}")
    return value
