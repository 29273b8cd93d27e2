"""Texts for the operator of a ground station (STATUSTEXT), and which events become one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.records import Event

TEXT_BYTES = 50
MAX_CHUNKS = 8
"""Largest number of chunks of one text; longer texts are truncated."""

MAX_TEXTS = 20.0
"""Texts per second on average, and in a burst twice as many; others are dropped."""

SENT_KINDS = ("say", "mission_ended")
"""Kinds of events that are sent at every level; of others, only warnings and errors."""

Send = Callable[[Any], object]
"""send(message): send a message of pymavlink to every station."""

NOTICE, WARNING, ERROR = mav.MAV_SEVERITY_NOTICE, mav.MAV_SEVERITY_WARNING, mav.MAV_SEVERITY_ERROR
_OF_LEVEL = {"warning": WARNING, "error": ERROR}


class Texts:
    """Sends texts, at a limited rate.

    Args:
        send: sends a message.
        clock: returns wall seconds.
    """

    def __init__(self, send: Send, clock: Callable[[], float]) -> None:
        self._send, self._clock = send, clock
        self._count = 0
        self._budget, self._last = 2.0 * MAX_TEXTS, clock()

    def tell(self, text: str, severity: int = NOTICE) -> None:
        """Send a text of any length, in chunks."""
        now = self._clock()
        self._budget = min(2.0 * MAX_TEXTS, self._budget + (now - self._last) * MAX_TEXTS)
        self._last = now
        if self._budget < 1.0:
            return
        self._budget -= 1.0
        chunks = list(text_chunks(text))
        number = 0
        if len(chunks) > 1:
            self._count = number = self._count % 65535 + 1
        for position, chunk in enumerate(chunks):
            self._send(mav.MAVLink_statustext_message(severity, chunk, number, position))

    def tell_event(self, event: Event) -> None:
        """Send warnings, errors and texts of the mission.

        Commands are left out: their stations are answered, and the others need not know.
        """
        if event.source == "command" and event.fields.get("status") != "failure":
            return
        if event.level in _OF_LEVEL:
            self.tell(event.text, _OF_LEVEL[event.level])
        elif event.kind in SENT_KINDS:
            self.tell(event.text, mav.MAV_SEVERITY_INFO)


def text_chunks(text: str) -> Iterator[bytes]:
    """Split a text into chunks of at most TEXT_BYTES bytes of UTF-8, between characters.

    The last of several chunks is shorter by one byte, for the zero that marks it as the last.
    """
    words = " ".join(text.split())
    last = TEXT_BYTES
    for _ in range(MAX_CHUNKS - 1):
        encoded = words.encode("utf-8", "replace")
        if len(encoded) <= last:
            break
        piece = encoded[:TEXT_BYTES].decode("utf-8", "ignore")
        yield piece.encode()
        words, last = words[len(piece) :], TEXT_BYTES - 1
    yield words.encode("utf-8", "replace")[:last].decode("utf-8", "ignore").encode()
