"""Where the dashboard gets its data: the telemetry client's face, so that tests can feed it too."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

from stack.telemetry.records import Ack, Command, Event, RunInfo, Snapshot


class Source(Protocol):
    """A run to watch. Nothing blocks."""

    @property
    def info(self) -> RunInfo | None:
        """What is fixed for the run; None until it was heard."""
        ...

    @property
    def silent_for(self) -> float:
        """Wall seconds since the engine was last heard."""
        ...

    @property
    def report(self) -> Mapping[str, Any] | None:
        """The report once the run is over."""
        ...

    def poll(self) -> Snapshot | None:
        """The newest snapshot since the last call, layers merged in; None when there is none."""
        ...

    def events(self) -> list[Event]:
        """New events, in order, without gaps."""
        ...

    def send(self, command: Command) -> None:
        """Give an order; the answer comes with `acks`."""
        ...

    def acks(self) -> list[Ack]:
        """Answers since the last call."""
        ...

    def close(self) -> None:
        """Let go of the run; it goes on."""
        ...
