"""STATUSTEXT messages, put together from their chunks."""

from __future__ import annotations

from typing import Any

MAX_OPEN, MAX_CHUNKS = 8, 20
"""Texts that are put together at the same time, and chunks of one."""

CHUNK = 50


class StatusTexts:
    """Puts texts together. A text of several chunks ends with one that is not full."""

    def __init__(self) -> None:
        self._open: dict[tuple[int, int, int], dict[int, str]] = {}

    def add(self, message: Any) -> str:
        """Return the whole text when a message completes one, else an empty text."""
        text = _plain(message.text)
        number = int(message.id)
        if number == 0:
            return text
        key = (message.get_srcSystem(), message.get_srcComponent(), number)
        if key not in self._open and len(self._open) >= MAX_OPEN:
            self._open.pop(next(iter(self._open)))
        chunks = self._open.setdefault(key, {})
        chunks[int(message.chunk_seq)] = text
        if len(text) >= CHUNK and len(chunks) < MAX_CHUNKS:
            return ""
        del self._open[key]
        return "".join(chunks[n] for n in sorted(chunks))


def _plain(text: Any) -> str:
    plain = text.decode("utf-8", "replace") if isinstance(text, bytes) else str(text)
    return "".join(character for character in plain if character.isprintable())
