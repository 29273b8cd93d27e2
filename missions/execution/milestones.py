"""Events that the report needs: the relocalisations."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from stack.telemetry.records import Event, RunInfo, Snapshot


class Milestones:
    """A telemetry sink that keeps the few events the report needs."""

    def __init__(self) -> None:
        self.relocalisations: list[dict[str, Any]] = []

    def open(self, info: RunInfo) -> None:
        """Do nothing."""

    def event(self, event: Event) -> None:
        """Keep a `relocalised` event: its time, pose and source."""
        if event.kind == "relocalised":
            self.relocalisations.append({"time": event.time, **event.fields})

    def wants_snapshot(self, time: float) -> bool:
        """Return False: no snapshot is needed."""
        return False

    def snapshot(self, snapshot: Snapshot) -> None:
        """Ignore the final snapshot, which every sink receives."""

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Do nothing."""
