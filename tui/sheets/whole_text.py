"""Texts of a run that do not fit into their panes."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from stack.telemetry.records import Event, TreeRow
from tui.drawing.palette import BUSY, DIM, TEXT, css
from tui.drawing.strips import one_line
from tui.panes.events_pane import line_of

MOST = 20
"""Events that are shown, the newest."""


class WholeText(ModalScreen[None]):
    """Shows why the mission is in its state, the message of a node, and the newest events.

    Args:
        reason: of the state of the mission; may be empty.
        row: the selected node of the tree; None without one.
        events: oldest first.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,enter,q", "close", "Back")]

    def __init__(self, reason: str, row: TreeRow | None, events: Sequence[Event]) -> None:
        super().__init__()
        self._reason, self._row, self._events = reason, row, events

    def compose(self) -> ComposeResult:
        """Compose one text that can be scrolled."""
        with VerticalScroll(classes="dialog wide") as dialog:
            dialog.border_title = "Whole text"
            dialog.border_subtitle = "↑↓ scroll · esc closes"
            yield Static(self._text())

    def action_close(self) -> None:
        """Return to the panes."""
        self.dismiss(None)

    def _text(self) -> Text:
        text, row = Text(), self._row
        if self._reason:
            _add(text, "Mission", self._reason)
        if row is not None:
            _add(text, f"{row.name}: {row.status}", row.message or "no message")
        text.append("Events, the newest first\n", style=f"bold {css(BUSY)}")
        for event in self._events[: -MOST - 1 : -1]:
            text.append_text(line_of(event))
            text.append("\n")
        if not self._events:
            text.append("none yet\n", style=css(DIM))
        return text


def _add(text: Text, heading: str, words: str) -> None:
    text.append(f"{one_line(heading)}\n", style=f"bold {css(BUSY)}")
    text.append(f"{one_line(words)}\n\n", style=css(TEXT))
