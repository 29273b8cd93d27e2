"""Sink that writes the snapshots of a run to snapshots.mcap (format.py)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stack.schedule import Schedule
from stack.telemetry.codec import codec_of, plain_fields
from stack.telemetry.hub import SNAPSHOTS
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import Event, Layer, RunInfo, Snapshot, TreeRow
from stack.telemetry.sinks import Sink
from stack.telemetry.snapshots.format import (
    BEAMS,
    EVENTS,
    FREQUENT,
    KEYFRAME_PERIOD,
    LAYER_PERIODS,
    LAYERS,
    MAX_PATCHES,
    PATCH,
    PICTURE_PERIOD,
    PICTURES,
    ROWS,
    ROWS_TYPE,
    SLOW,
    SLOW_PERIOD,
    recorded_fields,
)
from stack.telemetry.snapshots.mcap_file import McapFile
from stack.telemetry.snapshots.picture_codes import encoded
from stack.types import CameraModel, CostGrid, DepthImage, Image, OccupancyGrid, Scan


class SnapshotLog(Sink):
    """Writes the snapshots of a run.

    Args:
        path: of the file; replaced if it exists. `open` creates it.
        parameters: the rate, besides one snapshot after each event; and the limit of the size.
    """

    record = SNAPSHOTS

    def __init__(self, path: Path, parameters: RecordingParameters) -> None:
        self._file = McapFile(path, parameters.size_limit * 1e6)
        self._due, self._slow = Schedule(1.0 / parameters.rate), Schedule(SLOW_PERIOD)
        self._keyframes = Schedule(KEYFRAME_PERIOD)
        self._codecs = recorded_fields()
        self._fast = [name for name in self._codecs if name not in {*SLOW, "tree"}]
        self._rows = codec_of(ROWS_TYPE)
        self._values: dict[str, Any] = {}
        self._encoded: dict[str, Any] = {}
        self._tree: tuple[TreeRow, ...] | None = None
        self._layers: dict[str, _LayerLog] = {}
        self._pictures = {field: _PictureLog(name) for name, field in PICTURES.items()}
        self._events, self._something_happened = 0, True

    def open(self, info: RunInfo) -> None:
        """Create the file and describe the run in it."""
        self._file.open()
        self._file.write("/run", "RunInfo", 0.0, plain_fields(info))

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
        for field, log in self._pictures.items():
            log.write(self._file, getattr(snapshot, field), time)
        self._due.take(time)
        is_keyframe = self._keyframes.take(time)
        if is_keyframe:
            self._values.clear()
            self._encoded.clear()
            self._tree = None
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
        if before is None or [row.id for row in before] != [row.id for row in tree]:
            return {"tree": self._codecs["tree"].encode(tree)}
        changed = [pair for pair in enumerate(tree) if pair[1] is not before[pair[0]]]
        return {ROWS: self._rows.encode(changed)}


class _LayerLog:
    """Writes a layer when it changed, or only the changed part of a grid."""

    def __init__(self, name: str) -> None:
        self._topic = f"/layers/{name}"
        self._period = Schedule(LAYER_PERIODS.get(name, 0.0) or 1e-9)
        self._written: Layer | None = None
        self._patches = 0

    def write(self, file: McapFile, layer: Layer, time: float, *, at_once: bool) -> None:
        """Write the layer unless its version is written, or its period has not passed."""
        before = self._written
        if before is not None and before.version == layer.version:
            return
        if not self._period.take(time) and not at_once:
            return
        patch = None if before is None or self._patches >= MAX_PATCHES else _patch(before, layer)
        self._patches = 0 if patch is None else self._patches + 1
        self._written = layer
        whole = patch is None
        fields = plain_fields(layer) if whole else {"version": layer.version, PATCH: patch}
        file.write(self._topic, "Layer", time, fields)


class _PictureLog:
    """Writes the new pictures of one name, and their camera when it changed."""

    def __init__(self, name: str) -> None:
        self._name = name
        self._period = Schedule(PICTURE_PERIOD)
        self._stamp: float | None = None
        self._camera: CameraModel | None = None

    def write(self, file: McapFile, image: Image | DepthImage | None, time: float) -> None:
        """Write the picture unless it is written, or its period has not passed."""
        if image is None or image.stamp == self._stamp or not self._period.take(time):
            return
        self._stamp = image.stamp
        if image.camera != self._camera:
            self._camera = image.camera
            file.write(f"/cameras/{self._name}", "Camera", time, plain_fields(image.camera))
        file.write(f"/pictures/{self._name}", "Picture", time, plain_fields(encoded(image)))


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
