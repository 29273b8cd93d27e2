"""Interfaces of what receives the records of a run, and of what brings commands into it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from stack.telemetry.records import Ack, Command, Event, RunInfo, Snapshot


class Sink(Protocol):
    """Receiver of events and snapshots: recorder, rerun, ZeroMQ server, MAVLink, progress lines.

    All calls come from the engine's thread. A sink that raises is removed with a warning; the
    mission continues. Its methods do nothing: a class that inherits it overrides what it needs.
    """

    def open(self, info: RunInfo) -> None:
        """Start: called once, before the first event."""
        return

    def event(self, event: Event) -> None:
        """Receive an event; called for each event, in order."""
        return

    def wants_snapshot(self, time: float) -> bool:
        """Whether the sink needs a snapshot at this robot time, seconds; must be cheap."""
        return False

    def snapshot(self, snapshot: Snapshot) -> None:
        """Receive a snapshot that `wants_snapshot` asked for; also the last one of the run."""
        return

    def close(self, report: Mapping[str, Any] | None) -> None:
        """End: `report` is the content of report.json, or None after a crash."""
        return


@runtime_checkable
class RecordSink(Protocol):
    """A sink that writes a file of the run folder."""

    @property
    def record(self) -> str:
        """Path of the file relative to the run folder."""
        ...


@runtime_checkable
class LinkSink(Protocol):
    """A sink that connects the run with other programs."""

    @property
    def link(self) -> str:
        """What is connected, for the event log: `link_lost` names it."""
        ...


@runtime_checkable
class CommandSource(Protocol):
    """A sink that also receives commands of operators."""

    def service(self) -> None:
        """Answer connected clients; called often while no step is made. Never blocks."""
        ...

    def commands(self) -> list[Command]:
        """Return the commands received since the last call, in order."""
        ...

    def silence(self) -> float | None:
        """Wall seconds since an operator was heard; None while none is connected."""
        ...

    def acknowledge(self, ack: Ack) -> None:
        """Send the acknowledgement of a command to its sender."""
        ...
