"""Draws the recorded snapshots of a run for rerun."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from stack.telemetry.rerun.recording import FileOutput, Output, Recording
from stack.telemetry.rerun.snapshots import SnapshotDrawing
from stack.telemetry.snapshots.recording import SnapshotRecording

WRITTEN_AT_ONCE = 50
"""Snapshots between two writes: what is drawn is held in memory meanwhile."""


class RecordedDrawing:
    """Draws the snapshots of a run up to the last one, also while they are written.

    Args:
        recording: of the run.
        output: where the drawing goes.
    """

    def __init__(self, recording: SnapshotRecording, output: Output) -> None:
        self._recording = recording
        info = recording.info
        self._output = Recording(output, info.run_id, info.title or info.run_id)
        self._drawing = SnapshotDrawing(info, self._output)
        self._snapshots = self._events = 0

    def draw(self, told: Callable[[float], None] = lambda share: None) -> None:
        """Draw what was not drawn yet of what the recording knows.

        Args:
            told: called now and then with the share of the snapshots that is drawn.

        Raises:
            InputError: the recording is damaged.
            OSError: the output cannot be written.
        """
        count = len(self._recording.times)
        while self._snapshots < count:
            self._draw_one(self._snapshots)
            self._snapshots += 1
            if self._snapshots % WRITTEN_AT_ONCE == 0 or self._snapshots == count:
                self._output.write()
                told(self._snapshots / count)

    def close(self) -> None:
        """Close the output."""
        self._output.close()

    def _draw_one(self, number: int) -> None:
        end = self._recording.events_before(number)
        for event in self._recording.events(self._events, end):
            self._drawing.event(event)
        self._events = max(self._events, end)
        self._drawing.draw(self._recording.snapshot(number))


def is_current(folder: Path, file: Path) -> bool:
    """Whether a file was drawn from the snapshots as they are now."""
    try:
        drawn, snapshots = file.stat(), SnapshotRecording.path_in(folder).stat()
    except OSError:
        return False
    return drawn.st_mtime_ns >= snapshots.st_mtime_ns


def draw_recorded(
    folder: Path, file: Path, told: Callable[[float], None] = lambda share: None
) -> None:
    """Write a rerun recording of a run from its snapshots.

    The file appears when it is complete; it is as old as the snapshots that it shows.

    Args:
        folder: of the run.
        file: of the recording.
        told: called now and then with the share of the snapshots that is drawn.

    Raises:
        InputError: the folder has no snapshots, or they are damaged.
        OSError: the file cannot be written.
    """
    unfinished = file.with_name(f".{file.name}.{os.getpid()}.new")
    source = SnapshotRecording.path_in(folder)
    changed = source.stat().st_mtime_ns if source.exists() else 0  # before it is read
    try:
        with SnapshotRecording(folder) as recording:
            drawing = RecordedDrawing(recording, FileOutput(unfinished))
            try:
                drawing.draw(told)
            finally:
                drawing.close()
        os.utime(unfinished, ns=(changed, changed))
        unfinished.replace(file)
    finally:
        unfinished.unlink(missing_ok=True)
