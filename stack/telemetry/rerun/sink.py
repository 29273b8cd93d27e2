"""Sink that writes a recording for rerun's viewer. It imports rerun when it opens."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from stack.schedule import Schedule
from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import ROUTINE, Event, RunInfo, Snapshot

if TYPE_CHECKING:
    from stack.telemetry.rerun.snapshots import SnapshotDrawing


class RerunSink:
    """Records a run for rerun, on the timeline `mission_time` (robot time).

    A killed run leaves everything up to the last write.

    Attributes:
        path: of the recording; `open` creates it.
    """

    def __init__(self, path: Path, parameters: RecordingParameters | None = None) -> None:
        self.path = path
        self._parameters = parameters or RecordingParameters()
        self._snapshots = Schedule(1.0 / self._parameters.rate)
        self._drawing: SnapshotDrawing | None = None

    @property
    def record(self) -> str:
        """Name of the file in the run folder."""
        return self.path.name

    def open(self, info: RunInfo) -> None:
        """Create the file and draw the static entities."""
        from stack.telemetry.rerun.snapshots import SnapshotDrawing

        self._drawing = SnapshotDrawing(info, self.path, self._parameters)

    def event(self, event: Event) -> None:
        """Log the event unless it is routine."""
        assert self._drawing is not None
        if event.kind not in ROUTINE:
            self._drawing.event(event)

    def wants_snapshot(self, time: float) -> bool:
        """Whether a period of robot time has passed."""
        return self._snapshots.is_due(time)

    def snapshot(self, snapshot: Snapshot) -> None:
        """Draw a snapshot."""
        assert self._drawing is not None
        self._snapshots.take(snapshot.time)
        self._drawing.draw(snapshot)

    def close(self, report: Mapping[str, object] | None) -> None:
        """Write the rest and close the file. Safe to call twice."""
        drawing, self._drawing = self._drawing, None
        if drawing is not None:
            drawing.close()
