"""Base of the dashboard: what it owes to the terminal it runs in."""

from __future__ import annotations

from traceback import format_exception

from rich.console import RenderableType
from textual._compositor import CompositorUpdate
from textual.app import App
from textual.notifications import SeverityLevel
from textual.screen import Screen

from stack.types.printable import printable
from tui.terminal.ascii_glyphs import needs_ascii
from tui.terminal.cells import TerminalCells
from tui.terminal.driver import TerminalDriver


class TerminalApp(App[str]):
    """An app that writes only changed cells, and leaves out frames for a slow terminal.

    Attributes:
        crash: traceback of the exception that ended the app; empty without one. Nothing of it is
            written to the terminal.
    """

    def __init__(self) -> None:
        super().__init__(driver_class=TerminalDriver)
        self.crash = ""
        self._cells = TerminalCells(needs_ascii())
        self._left_out = False

    @property
    def terminal_is_gone(self) -> bool:
        """Whether the terminal was closed."""
        return isinstance(self._driver, TerminalDriver) and self._driver.is_gone

    def catch_up(self) -> None:
        """Draw what was left out, once the terminal has taken everything before it."""
        driver = self._driver
        if self._left_out and isinstance(driver, TerminalDriver) and not driver.is_behind:
            self._left_out = False
            self.screen.refresh()

    def action_redraw(self) -> None:
        """Write the whole screen, for a terminal that another program has written to."""
        self._cells.forget()
        if self.screen_stack:
            self.screen.refresh()

    def on_resize(self) -> None:
        """Write the whole screen after a change of size, even if it was changed back at once."""
        self.action_redraw()

    def notify(
        self, message: str, *, title: str = "", severity: SeverityLevel = "information",
        timeout: float | None = None, markup: bool = False,
    ) -> None:  # fmt: skip
        """Show a message for a while; control characters and markup in it have no effect."""
        super().notify(
            printable(message), title=title, severity=severity, timeout=timeout, markup=markup
        )

    def _display(self, screen: Screen[object], renderable: RenderableType | None) -> None:
        if isinstance(self._driver, TerminalDriver):
            if self._driver.is_behind:
                self._left_out = True
                return
            if isinstance(renderable, CompositorUpdate):
                renderable = self._cells.changes(renderable)
        super()._display(screen, renderable)

    def _handle_exception(self, error: Exception) -> None:
        self.crash = self.crash or "".join(format_exception(error))
        super()._handle_exception(error)

    def _fatal_error(self) -> None:
        self._close_messages_no_wait()

    def _print_error_renderables(self) -> None:
        self._exit_renderables.clear()
