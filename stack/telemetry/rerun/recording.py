"""Writer of one rerun recording: times, frames and visible entities."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from stack.telemetry.rerun.blueprint import TIMELINE
from stack.telemetry.rerun.file import RecordingFile

MAP, BASE, TRUTH = "map", "base", "truth"
"""Named frames of the recording; the robot model adds one for each link."""

Instances = Sequence[Any] | NDArray[Any]
"""Values of a component, one for each instance: e.g. (n, 3) positions."""

UP = (0.0, 0.0, 1.0)

NEVER = timedelta(hours=1)
"""rerun's own period for writes; `Recording.write` sets it instead."""


class _Rows:
    """Rows of one entity that were not sent yet: for each, its time and its instances."""

    def __init__(self, archetype: Any) -> None:
        self.archetype = archetype
        self.times: list[float] = []
        self.instances: dict[str, list[Instances]] = {}

    def add(self, time: float, instances: dict[str, Instances]) -> None:
        self.times.append(time)
        for name, values in instances.items():
            self.instances.setdefault(name, []).append(values)

    def columns(self) -> Any:
        """The columns, a row of each for every time."""
        lengths = [len(values) for values in next(iter(self.instances.values()))]
        columns = {name: _joined(rows) for name, rows in self.instances.items()}
        return self.archetype.columns(**columns).partition(lengths)


class Recording:
    """A recording that is being written.

    Rows of entities that change all the time are collected by `row` and sent as columns by `write`:
    for a row each, rerun takes ten times as long.

    Args:
        file: where the recording goes.
        limit: size that the file does not exceed, bytes.
        run_id: identifies the recording.
        title: shown in the viewer.

    Raises:
        OSError: the file cannot be created.

    Attributes:
        stream: rerun's stream, for entities without a frame.
    """

    def __init__(self, file: Path, limit: float, run_id: str, title: str) -> None:
        self._file = RecordingFile(file, limit)
        batches = rr.ChunkBatcherConfig(flush_tick=NEVER)
        self.stream = rr.RecordingStream("treepilot", recording_id=run_id, batcher_config=batches)
        self._encoded = rr.binary_stream(self.stream)
        self.stream.send_recording_name(title)
        self._time, self._is_broken = 0.0, False
        self._framed: set[str] = set()
        self._visible: set[str] = set()
        self._rows: dict[str, _Rows] = {}

    def at(self, time: float) -> None:
        """Set the robot time, seconds, of everything logged from now on."""
        self._time = time
        self.stream.set_time(TIMELINE, duration=time)

    def row(self, path: str, archetype: Any, **instances: Instances) -> None:
        """Add a row of an entity at the current time; `write` sends it.

        Args:
            path: of the entity.
            archetype: rerun's class, the same in each call for this entity.
            instances: by component, in equal number.
        """
        if path not in self._rows:
            self._rows[path] = _Rows(archetype)
        self._rows[path].add(self._time, instances)

    def show_row(self, path: str, archetype: Any, **instances: Instances) -> None:
        """Add a row of an entity in the map frame; it is visible from now on."""
        self.frame(path, MAP)
        self._visible.add(path)
        self.row(path, archetype, **instances)

    def show(self, path: str, *drawn: Any) -> None:
        """Draw an entity in the map frame at the current time."""
        self.frame(path, MAP)
        self._visible.add(path)
        self.stream.log(path, *drawn)

    def hide(self, path: str) -> None:
        """Remove an entity from the view if it is visible."""
        if path in self._visible:
            self._visible.discard(path)
            self.stream.log(path, rr.Clear(recursive=False))

    def fix(self, path: str, drawn: Any, frame: str = MAP) -> None:
        """Draw a static entity, or what is constant of an entity, for the whole run."""
        self._framed.add(path)
        self.stream.log(path, drawn, rr.CoordinateFrame(frame), static=True)

    def frame(self, path: str, name: str) -> bool:
        """Assign a frame to an entity, once; return whether it had none."""
        if path in self._framed:
            return False
        self._framed.add(path)
        self.stream.log(path, rr.CoordinateFrame(name), static=True)
        return True

    def write(self) -> None:
        """Write everything drawn so far to the file; nothing more after an error.

        Raises:
            RecordFull: the file reached its size limit.
            OSError: it cannot be written.
        """
        if self._is_broken:
            return
        columns: dict[tuple[float, ...], rr.TimeColumn] = {}
        for path, rows in self._rows.items():
            times = tuple(rows.times)  # most entities share theirs
            if times not in columns:
                columns[times] = rr.TimeColumn(TIMELINE, duration=rows.times)
            self.stream.send_columns(path, [columns[times]], rows.columns())
        self._rows.clear()
        encoded = self._encoded.read()
        if encoded:
            self._is_broken = True
            self._file.append(encoded)
            self._is_broken = False

    def close(self) -> None:
        """Close the file without writing what is waiting. Safe to call twice."""
        self.stream.disconnect()
        self._encoded.read(flush=False)  # rerun would warn about what nobody has read
        self._file.close()


def _joined(rows: list[Instances]) -> Any:
    """The instances of all rows, one after the other."""
    if all(isinstance(row, np.ndarray) for row in rows):
        return np.concatenate(rows)
    return list(chain.from_iterable(rows))
