"""Sink that writes the snapshots of a run to snapshots.mcap.

The file is an MCAP file without chunks, so that a killed run can be read up to its last complete
message. Each message is msgpack, compressed with zstd on its own:

    /run           once: the fields of RunInfo by name
    /keyframes     each KEYFRAME_PERIOD: all recorded fields of a Snapshot by name
    /changes       between them: the fields that differ from the snapshot before
    /layers/NAME   a layer, when it changed: before the first snapshot that refers to it

`log_time` is the robot's clock in nanoseconds. A value is encoded as on the wire (codec.py); the
schema of a topic tells the type of each field, so that a reader of another version finds the fields
that still mean the same. docs/runs.md describes the format for other programs.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from stack.schedule import Schedule
from stack.telemetry.codec import Codec, codec_of, field_codecs
from stack.telemetry.hub import SNAPSHOTS
from stack.telemetry.recorder import write_all
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import Event, Layer, RecordFull, RunInfo, Snapshot, TreeRow
from stack.telemetry.sinks import Sink
from stack.types import CostGrid, OccupancyGrid, Scan

FORMAT = "1"
"""Version of the format; increase it for changes that the schemas do not show."""

NANOSECONDS = 1e9

KEYFRAME_PERIOD = 5.0
"""Robot time between two keyframes, s: a reader decodes at most this much for one snapshot."""

SLOW_PERIOD = 1.0
"""Robot time between two records of what is large and changes little, s."""

SLOW = ("particles", "stages", "parameters", "depth_points", "counters", "sensors", "memory")

LAYER_PERIODS = {"local_costmap": 1.0, "global_costmap": 2.0}
"""Robot time between two records of a costmap, s. Other layers are recorded at each change."""

BEAMS = 360
"""Beams of a recorded scan at most: it is for displays, sensors.mcap has all of them."""

UNRECORDED = frozenset({"image", "depth_image", "layers", "events"})
"""Fields of a Snapshot that have other places: mission.rrd, topics of their own, events.jsonl."""

ROWS, LAYERS, EVENTS = "tree_rows", "layers", "events"
"""Besides the fields of a Snapshot: the changed rows of the tree as (index, row), the names of its
layers, and the number of events before it."""

PATCH, MAX_PATCHES = "patch", 20
"""A layer with the same frame as before may come as [top, left, rows, columns, bytes of cells]."""

FREQUENT = frozenset({"pose", "teleop"})
"""Kinds of events after which no snapshot is due."""

MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of an MCAP file."""

MESSAGE = struct.Struct("<BQHIQQ")
"""Kind and length of an MCAP record, then channel, sequence and two times of a message."""

MESSAGE_KIND, TIMES = 5, 22
"""Kind of a message; bytes of its fields before the data."""


ROWS_TYPE = tuple[tuple[int, TreeRow], ...]


def recorded_fields() -> dict[str, Codec]:
    """The codec of each field of a snapshot that is recorded as such, by name."""
    return {name: codec for name, codec in field_codecs(Snapshot).items() if name not in UNRECORDED}


def schemas() -> dict[str, dict[str, str]]:
    """The types of the fields of each kind of message, as text."""
    codecs = {
        "RunInfo": field_codecs(RunInfo),
        "Snapshot": {**recorded_fields(), ROWS: codec_of(ROWS_TYPE)},
        "Layer": field_codecs(Layer),
    }
    return {
        kind: {name: codec.shape for name, codec in fields.items()}
        for kind, fields in codecs.items()
    }


class SnapshotLog(Sink):
    """Writes the snapshots of a run.

    Args:
        path: of the file; replaced if it exists. `open` creates it.
        parameters: the rate, besides one snapshot after each event; and the limit of the size.
    """

    record = SNAPSHOTS

    def __init__(self, path: Path, parameters: RecordingParameters) -> None:
        self._file = _McapFile(path, parameters.size_limit * 1e6)
        self._due, self._slow = Schedule(1.0 / parameters.rate), Schedule(SLOW_PERIOD)
        self._keyframes = Schedule(KEYFRAME_PERIOD)
        self._codecs = recorded_fields()
        self._fast = [name for name in self._codecs if name not in {*SLOW, "tree"}]
        self._rows = codec_of(ROWS_TYPE)
        self._values: dict[str, Any] = {}
        self._encoded: dict[str, Any] = {}
        self._tree: tuple[TreeRow, ...] = ()
        self._layers: dict[str, _LayerLog] = {}
        self._events, self._something_happened = 0, True

    def open(self, info: RunInfo) -> None:
        """Create the file and describe the run in it."""
        self._file.open()
        fields = {
            name: codec.encode(getattr(info, name)) for name, codec in field_codecs(RunInfo).items()
        }
        self._file.write("/run", "RunInfo", 0.0, fields)

    def event(self, event: Event) -> None:
        """Note the event: the next snapshot is due, so that the state after it can be seen."""
        self._events = event.number + 1
        if event.kind not in FREQUENT:
            self._something_happened = True

    def wants_snapshot(self, time: float) -> bool:
        """Whether a period of robot time has passed, or something happened."""
        return self._something_happened or self._due.is_due(time)

    def snapshot(self, snapshot: Snapshot) -> None:
        """Write what changed.

        Raises:
            RecordFull: the file reached its size limit.
            OSError: it cannot be written, or the file was removed; the file ends before it.
        """
        time = snapshot.time
        for name, layer in snapshot.layers.items():
            if name not in self._layers:
                self._layers[name] = _LayerLog(name)
            self._layers[name].write(self._file, layer, time, at_once=snapshot.state.is_over)
        self._due.take(time)
        is_keyframe = self._keyframes.take(time)
        if is_keyframe:
            self._values.clear()
            self._encoded.clear()
            self._tree = ()
        fields = self._changes(snapshot, self._fast)
        if self._slow.take(time) or self._something_happened or is_keyframe:
            fields |= self._changes(snapshot, SLOW)
        self._something_happened = False
        fields |= self._tree_changes(snapshot.tree)
        fields |= {LAYERS: list(snapshot.layers), EVENTS: self._events}
        self._file.write("/keyframes" if is_keyframe else "/changes", "Snapshot", time, fields)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Close the file. Safe to call twice."""
        self._file.close()

    def _changes(self, snapshot: Snapshot, names: Iterable[str]) -> dict[str, Any]:
        """The encoded fields of these names that are not as they were."""
        values, encoded, changed = self._values, self._encoded, {}
        for name in names:
            value = getattr(snapshot, name)
            if name in values and values[name] is value:
                continue
            values[name] = value
            found = self._codecs[name].encode(_thinned(value) if name == "scan" else value)
            if name not in encoded or encoded[name] != found:
                encoded[name] = changed[name] = found
        return changed

    def _tree_changes(self, tree: tuple[TreeRow, ...]) -> dict[str, Any]:
        """The whole tree, or the rows that changed, or nothing."""
        before, self._tree = self._tree, tree
        if tree is before:
            return {}
        if [row.id for row in before] != [row.id for row in tree]:
            return {"tree": self._codecs["tree"].encode(tree)}
        changed = [pair for pair in enumerate(tree) if pair[1] is not before[pair[0]]]
        return {ROWS: self._rows.encode(changed)}


class _LayerLog:
    """Writes a layer when it changed, or only the changed part of a grid."""

    def __init__(self, name: str) -> None:
        self._topic = f"/layers/{name}"
        self._period = Schedule(LAYER_PERIODS.get(name, 0.0) or 1e-9)
        self._codecs = field_codecs(Layer)
        self._written: Layer | None = None
        self._patches = 0

    def write(self, file: _McapFile, layer: Layer, time: float, *, at_once: bool) -> None:
        """Write the layer unless its version is written, or its period has not passed."""
        before = self._written
        if before is not None and before.version == layer.version:
            return
        if not self._period.take(time) and not at_once:
            return
        patch = None if before is None or self._patches >= MAX_PATCHES else _patch(before, layer)
        self._patches = 0 if patch is None else self._patches + 1
        self._written = layer
        fields = {"version": layer.version, PATCH: patch} if patch is not None else {
            name: codec.encode(getattr(layer, name)) for name, codec in self._codecs.items()
        }  # fmt: skip
        file.write(self._topic, "Layer", time, fields)


def _patch(before: Layer, layer: Layer) -> list[Any] | None:
    """What changed of a grid: top, left, rows, columns, cells; None if that is not known."""
    old, new = before.content, layer.content
    if not isinstance(new, OccupancyGrid | CostGrid) or type(old) is not type(new):
        return None
    same = (old.cells.shape, old.origin, old.resolution) == (
        new.cells.shape, new.origin, new.resolution
    )  # fmt: skip
    boxes = [box for number, box in layer.changes if number > before.version]
    if not same or len(boxes) != layer.version - before.version:
        return None
    top, left = min(box[0] for box in boxes), min(box[2] for box in boxes)
    cells = new.cells[top : max(box[1] for box in boxes), left : max(box[3] for box in boxes)]
    return [top, left, *cells.shape, cells.tobytes()]


def _thinned(scan: Scan | None) -> Scan | None:
    """The scan with every n-th beam, so that it has at most BEAMS, and bearings as float32."""
    if scan is None:
        return None
    step = -(-scan.ranges.size // BEAMS)
    bearings = scan.bearings
    return Scan(
        scan.stamp, scan.ranges[::step], scan.angle_min, scan.angle_increment * step,
        scan.range_min, scan.range_max, scan.mount, scan.time_increment * step,
        None if bearings is None else bearings[::step].astype(np.float32),
    )  # fmt: skip


class _McapFile:
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
