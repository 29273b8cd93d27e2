"""Shows a run in this terminal, and leaves the terminal as it was even after a crash."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from traceback import format_exc

from tui.app import Dashboard
from tui.replay.app import ReplayDashboard
from tui.replay.player import Player
from tui.run_view import RunView
from tui.source import Source
from tui.terminal.restore import restore_terminal, terminal_settings


@dataclass(frozen=True, slots=True)
class Outcome:
    """How a dashboard ended.

    Attributes:
        name: over (the run has ended) | leave (it continues) | hangup (the terminal is gone) |
            abort (the operator aborted it) | interrupt (ctrl+c) | terminated (a signal ended the
            dashboard) | lost (the engine does not answer) | crashed.
        traceback: of a crash; empty without one.
    """

    name: str
    traceback: str = ""

    @property
    def trouble(self) -> str:
        """Last line of the traceback: the exception and its message."""
        return self.traceback.strip().rpartition("\n")[2]


def show(
    client: Source,
    terminated: Callable[[], bool] = lambda: False,
    *,
    owns_run: bool = False,
    is_demo: bool = False,
) -> Outcome:
    """Show a run until the operator leaves. Never raises an Exception.

    Args:
        client: the run; closed at the end.
        terminated: whether to end.
        owns_run: whether ctrl+c means `interrupt`; otherwise it asks.
        is_demo: whether the banner says what the robot does, and what to press.
    """
    return _shown(
        lambda: Dashboard(client, terminated=terminated, owns_run=owns_run, is_demo=is_demo)
    )


def show_recording(player: Player) -> Outcome:
    """Show a recorded run until the operator leaves. Never raises an Exception.

    Args:
        player: of the run; closed at the end.
    """
    return _shown(lambda: ReplayDashboard(player))


def _shown(make: Callable[[], RunView]) -> Outcome:
    settings = terminal_settings()
    try:
        app = make()
        result, traceback = app.run(), app.crash
    except KeyboardInterrupt:
        result, traceback = "terminated", ""
    except Exception:
        result, traceback = None, format_exc()
        if settings is not None:
            restore_terminal(sys.stderr, settings)
    return Outcome("crashed", traceback) if traceback else Outcome(result or "over")
