"""A viewer of rerun beside a run: a process of its own. The mission does not depend on it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from pathlib import Path

from missions.execution.supervision.child_process import command_of

ENDS_WITHIN = 4.0
"""Wall seconds that it gets to close the viewer."""


class RunViewer:
    """`treepilot runs open` for a live run.

    What it writes is kept until `tell` or `close`: the terminal may show a dashboard.
    """

    def __init__(self, folder: Path) -> None:
        self._output = tempfile.TemporaryFile()
        runs = "runs", "--folder", str(folder.parent), "open", folder.name
        self._is_told = False
        self._process: subprocess.Popen[bytes] | None = None
        with suppress(OSError):  # no process can be started now: the mission is more important
            self._process = subprocess.Popen(
                command_of("missions.cli.app", *runs), start_new_session=True,
                stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=self._output,
            )  # fmt: skip

    @property
    def has_failed(self) -> bool:
        """Whether it ended by itself with an error: there is no display, or no viewer."""
        return not self._is_told and bool(self._process is None or self._process.poll())

    def tell(self) -> None:
        """If it has failed, say why on stderr, once."""
        if self.has_failed:
            self._is_told = True
            self._output.seek(0)
            reason = self._output.read().decode(errors="replace").strip()
            print(f"rerun's viewer is not shown: {reason}", file=sys.stderr, flush=True)

    def close(self) -> None:
        """End it with the viewer."""
        self.tell()
        if self._process is not None:
            for number in (signal.SIGTERM, signal.SIGKILL):
                with suppress(ProcessLookupError):
                    os.killpg(self._process.pid, number)
                with suppress(subprocess.TimeoutExpired):
                    self._process.wait(ENDS_WITHIN)
        self._output.close()
