"""Writer of one rerun recording: times, frames and visible entities."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import rerun as rr

from stack.telemetry.rerun_blueprint import TIMELINE

MAP, BASE, OPTICAL, PICTURE = "map", "base", "camera_optical", "camera_picture"
"""Named frames of the recording; the robot model adds one for each link."""

UP = (0.0, 0.0, 1.0)


class Recording:
    """A recording file that is being written.

    Attributes:
        stream: rerun's stream, for entities without a frame.
    """

    def __init__(self, file: Path, run_id: str, title: str) -> None:
        self.stream = rr.RecordingStream("treepilot", recording_id=run_id)
        self.stream.save(file)
        self.stream.send_recording_name(title)
        self._framed: set[str] = set()
        self._visible: set[str] = set()

    def at(self, time: float) -> None:
        """Set the robot time, seconds, of everything logged from now on."""
        self.stream.set_time(TIMELINE, duration=time)

    def show(self, path: str, drawn: Any) -> None:
        """Draw an entity in the map frame at the current time."""
        self.frame(path, MAP)
        self._visible.add(path)
        self.stream.log(path, drawn)

    def hide(self, path: str) -> None:
        """Remove an entity from the view if it is visible."""
        if path in self._visible:
            self._visible.discard(path)
            self.stream.log(path, rr.Clear(recursive=False))

    def fix(self, path: str, drawn: Any) -> None:
        """Draw a static entity in the map frame for the whole run."""
        self.stream.log(path, drawn, rr.CoordinateFrame(MAP), static=True)

    def frame(self, path: str, name: str) -> bool:
        """Assign a frame to an entity, once; return whether it had none."""
        if path in self._framed:
            return False
        self._framed.add(path)
        self.stream.log(path, rr.CoordinateFrame(name), static=True)
        return True

    def close(self) -> None:
        """Flush and close the file."""
        self.stream.flush()
        self.stream.disconnect()
