"""Terminal driver that survives a terminal that stalls or disappears."""

from __future__ import annotations

import termios
from contextlib import suppress
from queue import Full

from textual.drivers.linux_driver import LinuxDriver

MOST_WAITING = 2
"""Writes that wait for the terminal, from which frames are left out."""

CLOSING_TIMEOUT = 1.0
"""Wall seconds that the end of the dashboard waits for a terminal that does not read."""


class TerminalDriver(LinuxDriver):
    """Textual's driver; a write never blocks the keys.

    Textual's own driver waits when thirty writes are waiting, and forever when the terminal is
    gone. Then no key would be handled, not even the emergency stop.
    """

    @property
    def is_behind(self) -> bool:
        """Whether the terminal has not yet taken what was written."""
        thread = self._writer_thread
        return thread is not None and thread._queue.qsize() >= MOST_WAITING

    @property
    def is_gone(self) -> bool:
        """Whether the terminal was closed."""
        thread = self._writer_thread
        if thread is not None and not thread.is_alive():
            return True
        try:
            termios.tcgetattr(self.fileno)
        except termios.error:
            return self.attrs_before is not None  # it was a terminal when the dashboard began
        return False

    def write(self, data: str) -> None:
        """Write to the terminal; discard the data if it does not read."""
        thread = self._writer_thread
        if thread is not None and thread.is_alive():
            with suppress(Full):
                thread._queue.put_nowait(data)

    def close(self) -> None:
        """Wait until the terminal has taken everything, for a limited time."""
        thread = self._writer_thread
        if thread is not None and thread.is_alive():
            with suppress(Full):
                thread._queue.put(None, timeout=CLOSING_TIMEOUT)
            thread.join(timeout=CLOSING_TIMEOUT)

    def _run_input_thread(self) -> None:
        """Read keys; end quietly when the terminal is closed, which the dashboard notices."""
        with suppress(OSError):
            self.run_input_thread()
