"""What a dashboard sets in a terminal, undone."""

from __future__ import annotations

import sys
import termios
from contextlib import suppress
from typing import Any, TextIO

RESTORE = (
    "\x1b[?2026l\x1b[?1000l\x1b[?1002l\x1b[?1003l\x1b[?1006l\x1b[?1015l\x1b[?1016l"
    "\x1b[?2004l\x1b[?2048l\x1b[?1004l\x1b[<u\x1b[?7h\x1b[?1049l\x1b[?25h\x1b[0m"
)
"""Synchronised output, reports of mouse, paste, size and focus off; keyboard protocol reset; line
wrap on, main screen, cursor on, plain style."""


def terminal_settings() -> list[Any] | None:
    """Return the settings of the terminal of this process; None without one."""
    with suppress(termios.error, OSError, ValueError):
        return termios.tcgetattr(sys.stdin.fileno())
    return None


def restore_terminal(stream: TextIO, settings: list[Any] | None) -> None:
    """Undo what a dashboard that could not do so itself has set; `stream` is what it drew on."""
    with suppress(OSError, ValueError):
        stream.write(RESTORE)
        stream.flush()
    if settings is not None:
        with suppress(termios.error, OSError):
            termios.tcsetattr(sys.stdin.fileno(), termios.TCSADRAIN, settings)
