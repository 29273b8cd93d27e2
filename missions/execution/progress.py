"""Progress lines of a run without a dashboard: events, and a periodic status line."""

from __future__ import annotations

from collections.abc import Callable

from stack.schedule import Schedule
from stack.telemetry.records import ROUTINE, Event, RunInfo, Snapshot
from stack.telemetry.sinks import Sink
from stack.types.printable import printable

HEARTBEAT = 10.0
"""Robot seconds between two status lines."""

SILENT = ROUTINE | {"plan", "goal", "task"}
"""Event kinds that are recorded but too frequent to print."""


class ProgressLines(Sink):
    """A telemetry sink that writes progress as lines of text."""

    def __init__(self, write: Callable[[str], None]) -> None:
        self._print, self._lines = write, Schedule(HEARTBEAT)

    def _write(self, line: str) -> None:
        """Write a line; names and texts in it may come from anywhere."""
        self._print(printable(line))

    def open(self, info: RunInfo) -> None:
        """Write the mission, robot, world and seed."""
        self._write(f"{info.title}: {info.robot} in {info.world}, seed {info.seed}")

    def event(self, event: Event) -> None:
        """Write one line, except for routine events."""
        if event.kind in SILENT and event.level == "info":
            return
        mark = {"warning": "! ", "error": "!! "}.get(event.level, "")
        self._write(f"{event.time:7.1f} s  {mark}{event.source}: {event.text}")

    def wants_snapshot(self, time: float) -> bool:
        """Return whether the next status line is due."""
        return self._lines.is_due(time)

    def snapshot(self, snapshot: Snapshot) -> None:
        """Write the status line: time, position and the running node."""
        self._lines.take(snapshot.time)
        if snapshot.state.is_over:
            return
        running = [row for row in snapshot.tree if row.status == "running"]
        doing = f"{running[-1].name} {running[-1].message}".strip() if running else snapshot.state
        place = f"at ({snapshot.pose.x:.1f}, {snapshot.pose.y:.1f})"
        speed = f", {snapshot.speed:.1f} x real time" if snapshot.speed else ""
        self._write(f"{snapshot.time:7.1f} s  {place}{speed}: {doing}")
