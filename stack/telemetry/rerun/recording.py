"""Writer of one rerun recording: times, frames and visible entities."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import timedelta
from itertools import chain
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import rerun as rr
from numpy.typing import NDArray

from stack.errors import TelemetryError
from stack.telemetry.rerun.blueprint import TIMELINE
from stack.telemetry.rerun.file import RecordingFile

MAP, BASE, TRUTH = "map", "base", "truth"
"""Named frames of the recording; the robot model adds one for each link."""

Instances = Sequence[Any] | NDArray[Any]
"""Values of a component, one for each instance: e.g. (n, 3) positions."""

UP = (0.0, 0.0, 1.0)

TAKEN_WITHIN = 60.0
"""Wall seconds within which a viewer takes what is sent to it."""

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


class Output(Protocol):
    """Where a recording goes."""

    def open(self, stream: Any) -> None:
        """Take what is logged to the stream from now on."""

    def write(self) -> None:
        """Write everything that was logged.

        Raises:
            OSError: it cannot be written.
            TelemetryError: nobody takes it.
        """

    def close(self) -> None:
        """Close it without writing what is waiting. Safe to call twice."""


class FileOutput:
    """A recording goes into a file.

    Raises:
        OSError: the file cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self._file = RecordingFile(path)
        self._encoded: Any = None

    def open(self, stream: Any) -> None:
        """Take what is logged to the stream from now on."""
        self._encoded = rr.binary_stream(stream)

    def write(self) -> None:
        """Append everything that was logged."""
        encoded = self._encoded.read()
        if encoded:
            self._file.append(encoded)

    def close(self) -> None:
        """Close the file."""
        self._encoded.read(flush=False)  # rerun would warn about what nobody has read
        self._file.close()


class ViewerOutput:
    """A recording goes to a viewer.

    Args:
        url: of the viewer's server.
    """

    def __init__(self, url: str) -> None:
        self._url = url
        self._stream: Any = None

    def open(self, stream: Any) -> None:
        """Take what is logged to the stream from now on."""
        self._stream = stream
        stream.connect_grpc(self._url)

    def write(self) -> None:
        """Send everything that was logged.

        Raises:
            TelemetryError: the viewer is gone, or does not take it.
        """
        try:
            self._stream.flush(timeout_sec=TAKEN_WITHIN)
        except (RuntimeError, TimeoutError) as error:
            raise TelemetryError(f"rerun's viewer does not take the run: {error}") from None

    def close(self) -> None:
        """Disconnect: `Recording` has done so."""


class Recording:
    """A recording that is being written.

    Rows of entities that change all the time are collected by `row` and sent as columns by `write`:
    for a row each, rerun takes ten times as long.

    Args:
        output: where the recording goes.
        run_id: identifies the recording.
        title: shown in the viewer.

    Attributes:
        stream: rerun's stream, for entities without a frame.
    """

    def __init__(self, output: Output, run_id: str, title: str) -> None:
        batches = rr.ChunkBatcherConfig(flush_tick=NEVER)
        self.stream = rr.RecordingStream("treepilot", recording_id=run_id, batcher_config=batches)
        self._output = output
        output.open(self.stream)
        self.stream.send_recording_name(title)
        self._time = 0.0
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
        """Write everything drawn so far.

        Raises:
            OSError: it cannot be written.
        """
        columns: dict[tuple[float, ...], rr.TimeColumn] = {}
        for path, rows in self._rows.items():
            times = tuple(rows.times)  # most entities share theirs
            if times not in columns:
                columns[times] = rr.TimeColumn(TIMELINE, duration=rows.times)
            self.stream.send_columns(path, [columns[times]], rows.columns())
        self._rows.clear()
        self._output.write()

    def close(self) -> None:
        """Close the output without writing what is waiting."""
        self.stream.disconnect()
        self._output.close()


def _joined(rows: list[Instances]) -> Any:
    """The instances of all rows, one after the other."""
    if all(isinstance(row, np.ndarray) for row in rows):
        return np.concatenate(rows)
    return list(chain.from_iterable(rows))
