"""Draws the recorded snapshots of a run for rerun: for runs without mission.rrd."""

from __future__ import annotations

from pathlib import Path

from stack.telemetry.recording_parameters import RecordingParameters
from stack.telemetry.records import ROUTINE
from stack.telemetry.rerun.snapshots import SnapshotDrawing
from stack.telemetry.snapshots.recording import SnapshotRecording


def draw_recorded(folder: Path, file: Path) -> None:
    """Write a rerun recording of a run from its snapshots; pictures of cameras are not in it.

    The file appears when it is complete.

    Args:
        folder: of the run.
        file: of the recording.

    Raises:
        InputError: the folder has no snapshots.
        OSError: the file cannot be written.
    """
    unfinished = file.with_name(f".{file.name}.new")
    with SnapshotRecording(folder) as recording:
        drawing, drawn = SnapshotDrawing(recording.info, unfinished, RecordingParameters()), 0
        try:
            for number in range(len(recording.times)):
                shot, told = recording.snapshot(number), recording.events_before(number)
                for event in recording.events(drawn, told):
                    if event.kind not in ROUTINE:
                        drawing.event(event)
                drawn = told
                drawing.draw(shot)
        finally:
            drawing.close()
    unfinished.replace(file)
