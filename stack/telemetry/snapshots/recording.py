"""Reads snapshots.mcap, of a finished run, of a killed one, or of one that is still written."""

from __future__ import annotations

import json
import os
import struct
from array import array
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, fields, replace
from io import BytesIO
from itertools import islice
from pathlib import Path
from typing import Any, Self, TypeVar

import numpy as np

from stack.documents.files import RECORD_BYTES, open_regular
from stack.errors import InputError
from stack.telemetry.codec import Codec, MalformedError, field_codecs
from stack.telemetry.event_log import event_of
from stack.telemetry.hub import EVENTS as EVENT_FILE
from stack.telemetry.hub import SNAPSHOTS
from stack.telemetry.records import Event, Layer, RunInfo, Snapshot
from stack.telemetry.snapshots.log import (
    EVENTS,
    FORMAT,
    LAYERS,
    MAGIC,
    MESSAGE,
    MESSAGE_KIND,
    NANOSECONDS,
    PATCH,
    ROWS,
    recorded_fields,
    schemas,
)

T = TypeVar("T")

SHOWN_EVENTS = 40
"""Events in a snapshot."""

_RECORD = struct.Struct("<BQ")
"""Kind and length of an MCAP record."""

_SCHEMA, _CHANNEL, _METADATA, _DATA_END = 0x03, 0x04, 0x0C, 0x0F


class SnapshotRecording:
    """The snapshots of a run by number and by time.

    A snapshot is decoded from the keyframe before it. Nothing else is held in memory but where the
    messages are: some 20 bytes for each.

    Args:
        folder: of the run.

    Raises:
        InputError: it has no snapshots, or the file is damaged or of another format.

    Attributes:
        info: description of the run.
        is_complete: whether the end of the file is written: the run has ended in order.
    """

    def __init__(self, folder: Path) -> None:
        self._path = folder / SNAPSHOTS
        try:
            self._file = open_regular(self._path)
        except OSError as error:
            raise InputError(
                f"{folder} has no snapshots that can be replayed: {SNAPSHOTS}: {error.strerror}"
            ) from None
        self.is_complete = False
        self._position = len(MAGIC)
        self._topics: dict[int, str] = {}
        self._readable: dict[str, dict[str, Codec]] = {}
        self._times = array("d")
        self._places, self._keyframes = array("Q"), array("L")
        self._layers: dict[str, _LayerIndex] = {}
        self._decompress = _decompressor()
        self._events = _EventFile(folder / EVENT_FILE)
        self._number, self._state = -1, dict[str, Any]()
        self._decoded_fields: dict[str, tuple[Any, Any]] = {}
        self._info: RunInfo | None = None
        self._version = ""
        try:
            self.info = self._begin()
        except BaseException:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def times(self) -> array[float]:
        """Robot time of each snapshot, s, ascending."""
        return self._times

    @property
    def path(self) -> Path:
        """The file."""
        return self._path

    def close(self) -> None:
        """Close the files."""
        self._file.close()
        self._events.close()

    def follow(self) -> int:
        """Take note of what was written since the last call; return the number of new snapshots.

        Raises:
            InputError: the file is damaged.
        """
        before, size = len(self._times), os.fstat(self._file.fileno()).st_size
        while not self.is_complete and self._position + _RECORD.size <= size:
            self._file.seek(self._position)
            head = self._file.read(MESSAGE.size)
            kind, length = _RECORD.unpack_from(head)
            if length > RECORD_BYTES:
                raise self._damaged(f"a record of {length} bytes at byte {self._position}")
            if self._position + _RECORD.size + length > size:  # its end is not written yet
                break
            self._note(kind, length, head)
            self._position += _RECORD.size + length
        return len(self._times) - before

    def index_at(self, time: float) -> int:
        """Number of the newest snapshot at a robot time, s; the first one before its time."""
        return max(0, bisect_right(self._times, time) - 1)

    def snapshot(self, number: int, *, whole: bool = True) -> Snapshot:
        """Return a snapshot.

        Args:
            number: of the snapshot, from 0.
            whole: with its layers and events.

        Raises:
            IndexError: there is no such snapshot.
            InputError: the file is damaged.
        """
        self._go_to(number)
        names = self._layer_names() if whole else ()
        layers = {name: self._layer(name, number) for name in names}
        try:
            return Snapshot(
                **self._fields(),
                layers={name: layer for name, layer in layers.items() if layer is not None},
                events=self._events.before(self._event_count(), SHOWN_EVENTS) if whole else (),
            )
        except TypeError as error:
            raise self._damaged(f"a snapshot lacks fields: {error}") from None

    def _go_to(self, number: int) -> None:
        """Make the state that of a snapshot."""
        if not 0 <= number < len(self._times):
            raise IndexError(f"snapshot {number} of {len(self._times)}")
        keyframe = self._keyframes[bisect_right(self._keyframes, number) - 1]
        if not keyframe <= self._number <= number:
            self._number, self._state = keyframe - 1, {}
        while self._number < number:
            self._number += 1
            self._apply(self._message(self._places[self._number]))

    def _layer_names(self) -> list[str]:
        names = self._state.get(LAYERS)
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise self._damaged("a snapshot does not name its layers")
        return names

    def _event_count(self) -> int:
        count = self._state.get(EVENTS)
        if type(count) is not int or count < 0:
            raise self._damaged("a snapshot does not say how many events were before it")
        return count

    def events(self, first: int, end: int) -> list[Event]:
        """The events of these numbers, without the last one."""
        return self._events.between(first, end)

    def events_before(self, number: int) -> int:
        """How many events were there when this snapshot was taken."""
        self._go_to(number)
        return self._event_count()

    def _begin(self) -> RunInfo:
        if self._file.read(len(MAGIC)) != MAGIC:
            raise InputError(f"{self._path} is not a recording: it is not an MCAP file")
        self.follow()
        if self._info is None or not self._times:
            raise InputError(f"{self._path} has no snapshot: the run ended before its first step")
        return self._info

    def _note(self, kind: int, length: int, head: bytes) -> None:
        if kind == MESSAGE_KIND and length >= MESSAGE.size - _RECORD.size:
            _, _, channel, _, stamp, _ = MESSAGE.unpack(head)
            self._note_message(self._topics.get(channel, ""), stamp / NANOSECONDS)
        elif kind in (_SCHEMA, _CHANNEL, _METADATA):
            self._describe(kind, length)
        elif kind == _DATA_END:
            self.is_complete = True

    def _note_message(self, topic: str, time: float) -> None:
        if topic == "/run":
            self._info = self._run_info()
        elif topic.startswith("/layers/"):
            index = self._layers.setdefault(topic.removeprefix("/layers/"), _LayerIndex())
            index.note(len(self._times), self._position)
        elif topic in ("/keyframes", "/changes"):
            if topic == "/keyframes":
                self._keyframes.append(len(self._times))
            if self._keyframes:
                self._times.append(time)
                self._places.append(self._position)

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
                self._version = Metadata.read(stream).metadata.get("version", "")
                self._refuse_format()
            else:
                schema = Schema.read(stream)
                self._readable[schema.name] = self._known(schema.name, json.loads(schema.data))
        except (McapError, struct.error, ValueError, AttributeError, TypeError) as error:
            raise self._damaged(str(error)) from None

    def _refuse_format(self) -> None:
        if self._version != FORMAT:
            raise InputError(
                f"{self._path} has the format {self._version:.20}, this version of treepilot reads"
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
                f"{self._path} was recorded by a version of treepilot whose {', '.join(lacking)} of"
                f" a {kind} is not what it is in this version; open it with that version"
                " (report.json names it)"
            )
        return {name: codec for name, codec in codecs.items() if name in known}

    def _run_info(self) -> RunInfo:
        return self._made(RunInfo, self._decoded(self._message(self._position), "RunInfo"))

    def _message(self, place: int) -> dict[str, Any]:
        """The content of the message at a place of the file."""
        self._file.seek(place)
        head = self._file.read(MESSAGE.size)
        _, length, *_ = MESSAGE.unpack(head)
        data = self._file.read(length - (MESSAGE.size - _RECORD.size))
        try:
            content = self._decompress(data)
        except ValueError as error:
            raise self._damaged(f"the message at byte {place}: {error}") from None
        if not isinstance(content, dict):
            raise self._damaged(f"the message at byte {place} is not a mapping")
        return content

    def _decoded(self, content: Mapping[str, Any], kind: str) -> dict[str, Any]:
        codecs = self._readable.get(kind, {})
        try:
            return {name: codecs[name].decode(content[name]) for name in codecs if name in content}
        except (MalformedError, TypeError, ValueError, OverflowError) as error:
            raise self._damaged(f"a malformed {kind}: {error}") from None

    def _made(self, kind: Callable[..., T], fields: Mapping[str, Any]) -> T:
        """A record of decoded fields; one that lacks some is damaged."""
        try:
            return kind(**fields)
        except TypeError as error:
            raise self._damaged(str(error)) from None

    def _apply(self, content: dict[str, Any]) -> None:
        """Apply a keyframe, or changes, to the state, which stays encoded."""
        rows = content.pop(ROWS, ())
        self._state |= content
        if not rows:
            return
        try:
            tree = list(self._state["tree"])
            for index, row in rows:
                tree[index] = row
        except (LookupError, TypeError, ValueError) as error:
            raise self._damaged(f"a malformed change of the tree: {error!r}") from None
        self._state["tree"] = tree

    def _fields(self) -> dict[str, Any]:
        """The decoded fields of the state; what has not changed is not decoded again."""
        fields, decoded = {}, self._decoded_fields
        for name, codec in self._readable.get("Snapshot", {}).items():
            if name not in self._state:
                continue
            encoded = self._state[name]
            if name not in decoded or decoded[name][0] is not encoded:
                try:
                    decoded[name] = encoded, codec.decode(encoded)
                except (MalformedError, TypeError, ValueError, OverflowError) as error:
                    raise self._damaged(f"a malformed Snapshot: {error}") from None
            fields[name] = decoded[name][1]
        return fields

    def _layer(self, name: str, number: int) -> Layer | None:
        """The newest version of a layer that was written before a snapshot."""
        index = self._layers.get(name)
        which = -1 if index is None else index.newest(number)
        if index is None or which < 0:
            return None
        if index.loaded is not None and index.number == which:
            return index.loaded
        steps: list[dict[str, Any]] = []
        first = which
        while first >= 0:
            if index.loaded is not None and index.number == first:
                break
            steps.append(self._message(index.places[first]))
            if PATCH not in steps[-1]:
                break
            first -= 1
        for content in reversed(steps):
            index.loaded = self._layer_of(content, index.loaded)
        index.number = which
        return index.loaded

    def _layer_of(self, content: dict[str, Any], before: Layer | None) -> Layer:
        patch = content.get(PATCH)
        if patch is None:
            return self._made(Layer, self._decoded(content, "Layer"))
        try:
            assert before is not None
            top, left, rows, columns, cells = patch
            grid: Any = before.content
            changed = grid.cells.copy()
            part = np.frombuffer(cells, changed.dtype).reshape(rows, columns)
            changed[top : top + rows, left : left + columns] = part
            return Layer(int(content["version"]), replace(grid, cells=changed))
        except (AssertionError, AttributeError, LookupError, TypeError, ValueError) as error:
            raise self._damaged(f"a malformed change of a layer: {error!r}") from None

    def _damaged(self, what: str) -> InputError:
        return InputError(f"{self._path} is damaged: {what}")


class _LayerIndex:
    """Where the versions of a layer are, and the one that is loaded."""

    def __init__(self) -> None:
        self.places, self._snapshots = array("Q"), array("L")
        self.loaded: Layer | None = None
        self.number = -1

    def note(self, snapshots: int, place: int) -> None:
        """Add a version that is written after so many snapshots."""
        self._snapshots.append(snapshots)
        self.places.append(place)

    def newest(self, snapshot: int) -> int:
        """Number of the newest version before a snapshot; -1: none."""
        return bisect_right(self._snapshots, snapshot) - 1


class _EventFile:
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
}
"""Fields that a reader cannot do without, and the codecs of all, by kind of record."""
