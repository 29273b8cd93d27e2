"""Requests to the autopilot that are repeated until they are answered: rates and parameters."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any

from robots.mavlink.hearing import AUTOPILOT_COMPONENT, Rover

RETRY, TRIES = 0.5, 6
"""Seconds until a rate is asked for again, and how often."""

READ_AGAIN, READS = 1.0, 3
"""Seconds until a parameter is asked for again, and how often: autopilots do not say that there is
none."""

SET_MESSAGE_INTERVAL = 511
IN_PROGRESS = 5


class Requests:
    """Message rates, one after the other since an answer does not say which one it is, and values.

    Args:
        rates: (message id, Hz).

    Attributes:
        refused: ids of messages that the autopilot does not send.
    """

    def __init__(self, rates: tuple[tuple[int, float], ...]) -> None:
        self._rates = rates
        self._asked: dict[str, int] = {}
        self.refused: set[int] = set()
        self.repeat()

    def repeat(self) -> None:
        """Ask for all rates again: the autopilot may have been restarted."""
        self._waiting = list(self._rates)
        self._sent, self._next, self._next_names = 0, 0.0, 0.0

    def due(self, now: float, dialect: Any, rover: Rover, values: Collection[str]) -> list[Any]:
        """Return the messages that are due.

        Args:
            now: seconds.
            dialect: pymavlink's module with messages.
            rover: that is asked.
            values: names of the parameters that have come.
        """
        messages = []
        if self._waiting and now >= self._next:
            if self._sent >= TRIES:
                self._answered()
            if self._waiting:
                number, rate = self._waiting[0]
                interval = 1e6 / rate
                messages.append(
                    dialect.MAVLink_command_long_message(
                        rover.system, AUTOPILOT_COMPONENT, SET_MESSAGE_INTERVAL, self._sent,
                        number, interval, 0.0, 0.0, 0.0, 0.0, 0.0,
                    )
                )  # fmt: skip
                self._sent += 1
                self._next = now + RETRY
        if now >= self._next_names:
            self._next_names = now + READ_AGAIN
            for name in rover.autopilot.read:
                if self._asked.get(name, 0) < READS and name not in values:
                    self._asked[name] = self._asked.get(name, 0) + 1
                    messages.append(
                        dialect.MAVLink_param_request_read_message(
                            rover.system, AUTOPILOT_COMPONENT, name.encode(), -1
                        )
                    )
        return messages

    def acknowledged(self, ack: Any) -> None:
        """Note an answer."""
        if ack.command == SET_MESSAGE_INTERVAL and self._waiting and self._sent:
            if ack.result == IN_PROGRESS:
                return
            if ack.result != 0:
                self.refused.add(self._waiting[0][0])
            self._answered()

    def _answered(self) -> None:
        self._waiting.pop(0)
        self._sent, self._next = 0, 0.0
