"""Shows a run in this terminal and leaves the terminal as it was, also after a crash."""

from __future__ import annotations

from collections.abc import Callable

from tui.app import Dashboard
from tui.source import Source


def show(client: Source, interrupted: Callable[[], bool] | None = None) -> str:
    """Show a run until the operator leaves."""
    return Dashboard(client, interrupted=interrupted).run() or "over"
