"""State of the connection to the engine."""

from __future__ import annotations

from dataclasses import dataclass

from stack.telemetry.records import Ack, Snapshot

STALE_AFTER = 2.0
"""Wall seconds without a message after which the screen is marked as out of date."""

LOST_AFTER = 5.0
"""Wall seconds without a message after which the engine counts as lost."""

CONFIRM_WITHIN = 10
"""Refreshes (1 s in total) after which an emergency stop without an answer is reported."""

FIRST_SNAPSHOT_WITHIN = 20.0
"""The same before the first snapshot: a first start compiles kernels for several seconds."""


@dataclass(frozen=True, slots=True)
class Link:
    """State of the connection to the engine.

    Attributes:
        silent_for: wall seconds since the last message.
        is_over: whether the engine has reported the end of the run.
        has_report: whether its report arrived.
        trouble: why its messages cannot be read; empty if they can.
        stop_unconfirmed: whether an emergency stop was sent and not answered in time.
        is_replay: whether this is a recorded run, which takes no commands.
    """

    silent_for: float
    is_over: bool = False
    has_report: bool = False
    trouble: str = ""
    stop_unconfirmed: bool = False
    is_replay: bool = False

    def is_lost(self, snapshot: Snapshot | None) -> bool:
        """Return whether the engine is silent although the run is not over."""
        over = self.is_over or (snapshot is not None and snapshot.state.is_over)
        timeout = FIRST_SNAPSHOT_WITHIN if snapshot is None else LOST_AFTER
        return not over and self.silent_for > timeout


class StopConfirmation:
    """Whether the engine has answered the emergency stops that were sent.

    Attributes:
        is_late: whether one is not answered in time, or could not be sent.
    """

    def __init__(self) -> None:
        self.is_late = False
        self._pending: set[str] = set()
        self._age = 0

    def sent(self, command_id: str) -> None:
        """Wait for the answer to a stop; an empty id: it could not be sent."""
        if not self._pending:
            self._age = 0
        self._pending.add(command_id)
        self.is_late = self.is_late or not command_id

    def refresh(self) -> None:
        """Count the refreshes of the screen."""
        self._age += 1
        self.is_late = bool(self._pending) and (self.is_late or self._age > CONFIRM_WITHIN)

    def take(self, ack: Ack) -> bool:
        """Take an answer; return whether it confirms a stop that was waiting for one."""
        if ack.id not in self._pending:
            return False
        if ack.done:
            self._pending.clear()
            self.is_late = False
        return ack.done
