"""One rerun recording being written: times, frames, and what is visible now."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import rerun as rr

from stack.telemetry.rerun_blueprint import TIMELINE

MAP, BASE, OPTICAL, PICTURE = "map", "base", "camera_optical", "camera_picture"
"""Rerun's named frames here; the robot model adds one for each of its links."""

UP = (0.0, 0.0, 1.0)


class Recording:
    """A file in rerun's format.

    Attributes:
        stream: for what needs no frame.
    """

    def __init__(self, file: Path, run_id: str, title: str) -> None:
        self.stream = rr.RecordingStream("treepilot", recording_id=run_id)
        self.stream.save(file)
        self.stream.send_recording_name(title)
        self._framed: set[str] = set()
        self._visible: set[str] = set()

    def at(self, time: float) -> None:
        """Everything from now on belongs to this robot time."""
        self.stream.set_time(TIMELINE, duration=time)

    def show(self, path: str, drawn: Any) -> None:
        """Draw an entity that lives in the map frame, now."""
        self.frame(path, MAP)
        self._visible.add(path)
        self.stream.log(path, drawn)

    def hide(self, path: str) -> None:
        """An entity is no longer there."""
        if path in self._visible:
            self._visible.discard(path)
            self.stream.log(path, rr.Clear(recursive=False))

    def fix(self, path: str, drawn: Any) -> None:
        """Draw an entity that stands still in the map frame for the whole run."""
        self.stream.log(path, drawn, rr.CoordinateFrame(MAP), static=True)

    def frame(self, path: str, name: str) -> bool:
        """Say once in which frame an entity lives; whether that was news."""
        if path in self._framed:
            return False
        self._framed.add(path)
        self.stream.log(path, rr.CoordinateFrame(name), static=True)
        return True

    def close(self) -> None:
        """Write what is left and end the file."""
        self.stream.flush()
        self.stream.disconnect()
