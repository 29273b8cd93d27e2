"""Progress lines for a run without a dashboard: what happened, and a heartbeat."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from stack.telemetry.records import ROUTINE, Event, RunInfo, Snapshot

HEARTBEAT = 10.0
"""Robot seconds between two lines that say all is well."""

SILENT = ROUTINE | {"plan", "goal", "task"}
"""Kinds that are in the records but would drown the lines."""


class ProgressLines:
    """A telemetry sink that says in words what goes on."""

    def __init__(self, write: Callable[[str], None]) -> None:
        self._write, self._next = write, 0.0

    def open(self, info: RunInfo) -> None:
        """Say what begins."""
        self._write(f"{info.title}: {info.robot} in {info.world}, seed {info.seed}")

    def event(self, event: Event) -> None:
        """One line for each event worth a person's time."""
        if event.kind in SILENT and event.level == "info":
            return
        mark = {"warning": "! ", "error": "!! "}.get(event.level, "")
        self._write(f"{event.time:7.1f} s  {mark}{event.source}: {event.text}")

    def wants_snapshot(self, time: float) -> bool:
        """Once every heartbeat."""
        return time >= self._next

    def snapshot(self, snapshot: Snapshot) -> None:
        """Where it is and what it does."""
        self._next = snapshot.time + HEARTBEAT
        if snapshot.state.is_over:
            return
        running = [row for row in snapshot.tree if row.status == "running"]
        doing = f"{running[-1].name} {running[-1].message}".strip() if running else snapshot.state
        self._write(
            f"{snapshot.time:7.1f} s  at ({snapshot.pose.x:.1f}, {snapshot.pose.y:.1f}),"
            f" {snapshot.speed:.0f} x real time: {doing}"
        )

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Nothing to close."""
