"""Messages of the engine to its supervisor: lines of JSON through a pipe."""

from __future__ import annotations

import json
import os
from contextlib import suppress
from typing import Any

MESSAGE_BYTES = 64 << 20
"""An engine that sends more without an end of line is not read further."""


class Outbox:
    """The engine's end of the pipe. Without a supervisor, messages are discarded."""

    def __init__(self, descriptor: int = -1) -> None:
        self._descriptor = descriptor

    def send(self, kind: str, **content: Any) -> None:
        """Send a message; waits while the pipe is full, discards it if nobody reads."""
        if self._descriptor < 0:
            return
        line = json.dumps({"kind": kind, **content}, allow_nan=False).encode() + b"\n"
        with suppress(OSError):
            while line:
                line = line[os.write(self._descriptor, line) :]


class Inbox:
    """The supervisor's end of the pipe."""

    def __init__(self, descriptor: int) -> None:
        os.set_blocking(descriptor, False)
        self._descriptor, self._rest = descriptor, b""

    def receive(self) -> list[dict[str, Any]]:
        """Return the complete messages since the last call; damaged ones are left out."""
        while len(self._rest) < MESSAGE_BYTES:
            try:
                more = os.read(self._descriptor, 1 << 16)
            except BlockingIOError:
                break
            if not more:
                break
            self._rest += more
        *lines, self._rest = self._rest.split(b"\n")
        return [message for line in lines if (message := _message(line)) is not None]


def _message(line: bytes) -> dict[str, Any] | None:
    try:
        message = json.loads(line)
    except ValueError:
        return None
    return message if isinstance(message, dict) and "kind" in message else None
