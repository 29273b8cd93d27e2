"""Data source of the dashboard: the interface of the telemetry client."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from stack.telemetry.records import Ack, Command, Event, RunInfo, Snapshot


class Source(Protocol):
    """A run to show. No method blocks."""

    @property
    def info(self) -> RunInfo | None:
        """Description of the run; None until it arrived."""
        ...

    @property
    def pictures(self) -> bool:
        """Whether snapshots have the camera's newest picture, small; off at first."""
        ...

    @pictures.setter
    def pictures(self, wanted: bool) -> None: ...

    @property
    def silent_for(self) -> float:
        """Wall seconds since the last message of the engine."""
        ...

    @property
    def is_over(self) -> bool:
        """Whether the engine has reported the end of the run."""
        ...

    @property
    def report(self) -> Mapping[str, Any] | None:
        """Report of the ended run; None before, and after a crash."""
        ...

    def poll(self) -> Snapshot | None:
        """Return the newest snapshot since the last call, with its layers; None without a new one.

        Raises:
            TelemetryError: the engine uses another version of the protocol.
        """
        ...

    def events(self) -> list[Event]:
        """Return the new events, in order, without gaps."""
        ...

    def send(self, command: Command) -> None:
        """Send a command; `acks` returns the answer.

        Raises:
            TelemetryError: the command cannot be sent.
        """
        ...

    def acks(self) -> list[Ack]:
        """Return the answers since the last call."""
        ...

    def close(self) -> None:
        """Detach from the run; it continues."""
        ...
