"""Base of the dashboard: what it owes to the terminal it runs in."""

from __future__ import annotations

import io
from traceback import format_exception

from rich.color import ColorSystem
from rich.console import Console, RenderableType
from rich.terminal_theme import TerminalTheme
from rich.text import Text
from textual._compositor import CompositorUpdate
from textual.app import App
from textual.filter import Monochrome
from textual.notifications import SeverityLevel
from textual.screen import Screen

from stack.types.printable import printable
from tui.terminal.ascii_glyphs import needs_ascii
from tui.terminal.cells import TerminalCells
from tui.terminal.driver import TerminalDriver
from tui.terminal.themes import THEMES, chosen_theme, usual_theme

ANSI = (
    [(0, 0, 0), (205, 0, 0), (0, 205, 0), (205, 205, 0), (0, 0, 238), (205, 0, 205),
     (0, 205, 205), (229, 229, 229)],
    [(127, 127, 127), (255, 0, 0), (0, 255, 0), (255, 255, 0), (92, 92, 255), (255, 0, 255),
     (0, 255, 255), (255, 255, 255)],
)  # fmt: skip
"""Colours of xterm, as those of the pictures of a terminal with 16 colours."""

XTERM = TerminalTheme((0, 0, 0), (229, 229, 229), *ANSI)
LIGHT_XTERM = TerminalTheme((235, 240, 248), (0, 0, 0), *ANSI)

THEME_WORDS = {"dark": "dark", "light": "light", "16": "the terminal's 16", "none": "none"}


class TerminalApp(App[str]):
    """An app that writes only changed cells, and leaves out frames for a slow terminal.

    Attributes:
        crash: traceback of the exception that ended the app; empty without one. Nothing of it is
            written to the terminal.
    """

    def __init__(self) -> None:
        theme = chosen_theme()
        super().__init__(driver_class=TerminalDriver)
        self._filters = [one for one in self._filters if not isinstance(one, Monochrome)]
        self.crash = ""
        self._cells = TerminalCells(needs_ascii(), theme)
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

    @property
    def shown_theme(self) -> str:
        """The theme of the dashboard: one of `themes.THEMES`."""
        system = self.console._color_system or ColorSystem.TRUECOLOR
        return self._cells.theme or usual_theme(system)

    def show_theme(self, theme: str) -> None:
        """Draw everything in a theme."""
        self._cells.theme = theme
        self.action_redraw()

    def action_theme(self) -> None:
        """Draw everything in the next theme."""
        self.show_theme(THEMES[(THEMES.index(self.shown_theme) + 1) % len(THEMES)])
        self.notify(THEME_WORDS[self.shown_theme], title="colours", timeout=1.5)

    def cells(self) -> TerminalCells:
        """Return what a terminal with all colours would show."""
        cells = TerminalCells(needs_ascii(), self._cells.theme)
        update = self.screen._compositor.render_update(
            full=True, screen_stack=self._background_screens, simplify=False
        )
        assert isinstance(update, CompositorUpdate)
        cells.write(update, ColorSystem.TRUECOLOR)
        return cells

    def export_screenshot(self, *, title: str | None = None, simplify: bool = False) -> str:
        """Return a picture, as SVG, of what the terminal shows: in its theme and characters.

        `simplify` has no effect: cells of equal style are one piece of the picture anyway.
        """
        paper = Console(
            width=self.size.width, height=self.size.height, file=io.StringIO(), record=True,
            force_terminal=True, color_system="truecolor",
        )  # fmt: skip
        paper.print(Text.from_ansi(self.cells().ansi), no_wrap=True, end="")
        return paper.export_svg(
            title=title or self.title, theme=LIGHT_XTERM if self.shown_theme == "light" else XTERM
        )

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
