"""Reads snapshots.mcap, of a finished run, of a killed one, or of one that is still written."""

from __future__ import annotations

from array import array
from bisect import bisect_right
from pathlib import Path
from typing import Any, Self

from stack.errors import InputError
from stack.telemetry.hub import EVENTS as EVENT_FILE
from stack.telemetry.hub import SNAPSHOTS
from stack.telemetry.records import Event, Layer, RunInfo, Snapshot
from stack.telemetry.snapshots.event_file import EventFile
from stack.telemetry.snapshots.format import EVENTS, LAYERS, PICTURES, ROWS
from stack.telemetry.snapshots.message_file import Entry, MessageFile
from stack.telemetry.snapshots.versions import RecordedLayer, RecordedPictures

SHOWN_EVENTS = 40
"""Events in a snapshot."""


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
    """

    def __init__(self, folder: Path) -> None:
        try:
            self._file = MessageFile(self.path_in(folder))
        except OSError as error:
            raise InputError(
                f"{folder} has no snapshots that can be replayed: {SNAPSHOTS}: {error.strerror}"
            ) from None
        self._times = array("d")
        self._places, self._keyframes = array("Q"), array("L")
        self._layers: dict[str, RecordedLayer] = {}
        self._pictures = {
            name: RecordedPictures(self._file, is_depth=name == "depth") for name in PICTURES
        }
        self._events = EventFile(folder / EVENT_FILE)
        self._number, self._state = -1, dict[str, Any]()
        self._decoded_fields: dict[str, tuple[Any, Any]] = {}
        self._info: RunInfo | None = None
        try:
            self.info = self._begin()
        except BaseException:
            self.close()
            raise

    @staticmethod
    def path_in(folder: Path) -> Path:
        """The file of a run."""
        return folder / SNAPSHOTS

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
        return self._file.path

    @property
    def is_complete(self) -> bool:
        """Whether the end of the file is written: the run has ended in order."""
        return self._file.is_complete

    def close(self) -> None:
        """Close the files."""
        self._file.close()
        self._events.close()

    def follow(self) -> int:
        """Take note of what was written since the last call; return the number of new snapshots.

        Raises:
            InputError: the file is damaged.
        """
        before = len(self._times)
        for entry in self._file.follow():
            self._note(entry)
        return len(self._times) - before

    def index_at(self, time: float) -> int:
        """Number of the newest snapshot at a robot time, s; the first one before its time."""
        return max(0, bisect_right(self._times, time) - 1)

    def snapshot(self, number: int, *, whole: bool = True) -> Snapshot:
        """Return a snapshot.

        Args:
            number: of the snapshot, from 0.
            whole: with its layers, pictures and events.

        Raises:
            IndexError: there is no such snapshot.
            InputError: the file is damaged.
        """
        self._go_to(number)
        large: dict[str, Any] = {}
        if whole:
            large = {field: self._pictures[name].before(number) for name, field in PICTURES.items()}
            large["layers"] = self._layers_before(number)
            large["events"] = self._events.before(self._event_count(), SHOWN_EVENTS)
        try:
            return Snapshot(**self._fields(), **large)
        except TypeError as error:
            raise self._file.damaged(f"a snapshot lacks fields: {error}") from None

    def events(self, first: int, end: int) -> list[Event]:
        """The events of these numbers, without the last one."""
        return self._events.between(first, end)

    def events_before(self, number: int) -> int:
        """How many events were there when this snapshot was taken."""
        self._go_to(number)
        return self._event_count()

    def _begin(self) -> RunInfo:
        self.follow()
        if self._info is None or not self._times:
            raise InputError(f"{self.path} has no snapshot: the run ended before its first step")
        return self._info

    def _note(self, entry: Entry) -> None:
        count = len(self._times)
        first, _, name = entry.topic[1:].partition("/")
        if entry.topic == "/run":
            self._info = self._file.record(RunInfo, self._file.message(entry.place), "RunInfo")
        elif first == "layers":
            layer = self._layers.setdefault(name, RecordedLayer(self._file))
            layer.index.note(count, entry.place)
        elif first == "pictures" and name in self._pictures:
            self._pictures[name].pictures.note(count, entry.place)
        elif first == "cameras" and name in self._pictures:
            self._pictures[name].cameras.note(count, entry.place)
        elif entry.topic in ("/keyframes", "/changes"):
            if entry.topic == "/keyframes":
                self._keyframes.append(count)
            if self._keyframes:
                self._times.append(entry.time)
                self._places.append(entry.place)

    def _go_to(self, number: int) -> None:
        """Make the state that of a snapshot."""
        if not 0 <= number < len(self._times):
            raise IndexError(f"snapshot {number} of {len(self._times)}")
        keyframe = self._keyframes[bisect_right(self._keyframes, number) - 1]
        if not keyframe <= self._number <= number:
            self._number, self._state = keyframe - 1, {}
        while self._number < number:
            self._number += 1
            self._apply(self._file.message(self._places[self._number]))

    def _layers_before(self, number: int) -> dict[str, Layer]:
        names = self._state.get(LAYERS)
        if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
            raise self._file.damaged("a snapshot does not name its layers")
        found = {name: self._layers[name].before(number) for name in names if name in self._layers}
        return {name: layer for name, layer in found.items() if layer is not None}

    def _event_count(self) -> int:
        count = self._state.get(EVENTS)
        if type(count) is not int or count < 0:
            raise self._file.damaged("a snapshot does not say how many events were before it")
        return count

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
            raise self._file.damaged(f"a malformed change of the tree: {error!r}") from None
        self._state["tree"] = tree

    def _fields(self) -> dict[str, Any]:
        """The decoded fields of the state; what has not changed is not decoded again."""
        fields, decoded = {}, self._decoded_fields
        for name, codec in self._file.codecs("Snapshot").items():
            if name not in self._state:
                continue
            encoded = self._state[name]
            if name not in decoded or decoded[name][0] is not encoded:
                decoded[name] = encoded, self._file.decoded(codec, encoded, "Snapshot")
            fields[name] = decoded[name][1]
        return fields
