"""The dashboard as a process of its own: the supervisor continues without it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

from missions.execution.supervision.child_process import command_of
from tui.terminal.restore import restore_terminal, terminal_settings
from tui.terminal.themes import chosen_theme

CLOSE_WITHIN = 2.0
"""Wall seconds that a dashboard gets to end after the run was interrupted."""


def check_settings() -> None:
    """Check what the environment says about the dashboard, before anything runs.

    Raises:
        InputError: it asks for a theme that does not exist.
    """
    chosen_theme()


class Viewer:
    """A dashboard in the terminal of this process.

    Attributes:
        trouble: why it crashed, in one line; empty if it did not.
        traceback: of the crash.
    """

    def __init__(
        self, handle: Mapping[str, Any], *, owns_run: bool = False, is_demo: bool = False
    ) -> None:
        """Open it for a run, named by the handle of its telemetry.

        Args:
            handle: of the run.
            owns_run: whether ctrl+c in it ends the run; otherwise it asks.
            is_demo: whether it says all the time what the robot does, and what to press.
        """
        self._settings = terminal_settings()
        self._outcome, theirs = os.pipe()
        self._process = subprocess.Popen(
            command_of(
                "tui",
                handle["address"],
                handle["identity"],
                str(theirs),
                "demo" if is_demo else "owner" if owns_run else "",
            ),
            pass_fds=(theirs,),
        )
        os.close(theirs)
        self.trouble = self.traceback = ""

    @property
    def is_open(self) -> bool:
        """Whether it is still shown."""
        return self._process.poll() is None

    def wait(self, seconds: float) -> None:
        """Wait for its end for some seconds."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=seconds)

    def close(self) -> str:
        """End it if it is open, restore the terminal, and return the outcome.

        Returns:
            over | leave | hangup | abort | interrupt | terminated | lost, as the dashboard says, or
            `crashed`.
        """
        was_open = self.is_open
        if was_open:
            self._process.terminate()
            self.wait(CLOSE_WITHIN)
            self._process.kill()
            self._process.wait()
        text = os.read(self._outcome, 1 << 16)
        os.close(self._outcome)
        try:
            answer = json.loads(text)
        except ValueError:
            answer = {}
        outcome = str(answer.get("outcome", ""))
        if not outcome:
            outcome = "over" if was_open else "crashed"
        if outcome == "crashed":
            code = self._process.returncode
            self.trouble = str(answer.get("trouble") or f"it ended with exit code {code}")
            self.traceback = str(answer.get("traceback", ""))
        if was_open or outcome == "crashed":
            restore_terminal(sys.stdout, self._settings)
        return outcome
