"""Shows a run in this terminal, and leaves the terminal as it was even after a crash."""

from __future__ import annotations

import sys
import termios
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from traceback import format_exc
from typing import Any

from tui.app import Dashboard
from tui.source import Source
from tui.terminal.restore import RESTORE


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a dashboard ended.

    Attributes:
        name: over (the run has ended) | leave (it continues) | hangup (the terminal is gone) |
            abort (the operator aborted it) | interrupt (ctrl+c, or a signal) | lost (the engine
            does not answer) | crashed.
        traceback: of a crash; empty without one.
    """

    name: str
    traceback: str = ""

    @property
    def trouble(self) -> str:
        """Last line of the traceback: the exception and its message."""
        return self.traceback.strip().rpartition("\n")[2]


def show(
    client: Source, interrupted: Callable[[], bool] = lambda: False, *, owns_run: bool = False
) -> Outcome:
    """Show a run until the operator leaves. Never raises an Exception.

    Args:
        client: the run; closed at the end.
        interrupted: whether to end.
        owns_run: whether ctrl+c means `interrupt`; otherwise it asks.
    """
    settings = _terminal_settings()
    try:
        app = Dashboard(client, interrupted=interrupted, owns_run=owns_run)
        result, traceback = app.run(), app.crash
    except KeyboardInterrupt:
        result, traceback = "interrupt", ""
    except Exception:
        result, traceback = None, format_exc()
        _restore(settings)
    return Outcome("crashed", traceback) if traceback else Outcome(result or "over")


def _terminal_settings() -> list[Any] | None:
    with suppress(termios.error, OSError, ValueError):
        return termios.tcgetattr(sys.stdin.fileno())
    return None


def _restore(settings: list[Any] | None) -> None:
    """Undo what a dashboard that could not do so itself has set."""
    if settings is None:
        return
    with suppress(termios.error, OSError, ValueError):
        sys.stderr.write(RESTORE)
        sys.stderr.flush()
        termios.tcsetattr(sys.stdin.fileno(), termios.TCSADRAIN, settings)
