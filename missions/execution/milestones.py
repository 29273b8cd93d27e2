"""Remembers what the report tells of the events: how the pose was found again."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stack.telemetry.records import Event, RunInfo, Snapshot


class Milestones:
    """A telemetry sink that keeps the few events the report needs."""

    def __init__(self) -> None:
        self.relocalisations: list[dict[str, Any]] = []

    def open(self, info: RunInfo) -> None:
        """Nothing to prepare."""

    def event(self, event: Event) -> None:
        """Keep a new pose with its source."""
        if event.kind == "relocalised":
            self.relocalisations.append({"time": event.time, **event.fields})

    def wants_snapshot(self, time: float) -> bool:
        """Never."""
        return False

    def snapshot(self, snapshot: Snapshot) -> None:
        """The last one comes unasked; nothing to keep of it."""

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Nothing to close."""
