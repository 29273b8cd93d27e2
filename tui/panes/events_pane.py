"""Event log with a level filter."""

from __future__ import annotations

from collections import deque

from rich.text import Text
from textual.widgets import RichLog

from stack.telemetry.records import ROUTINE, Event
from tui.drawing.palette import BAD, DIM, GOOD, TEXT, WARN, css
from tui.drawing.strips import clock, one_line

LEVELS = {"everything": -1, "info and up": 0, "warnings and errors": 1, "errors": 2}
RANK = {"info": 0, "warning": 1, "error": 2}
LEVEL_GLYPH = {"info": ("·", GOOD), "warning": ("▲", WARN), "error": ("✘", BAD)}

KEPT = 2000


class EventsPane(RichLog):
    """Shows events as lines and keeps them, so that a new filter also applies to old events."""

    BORDER_TITLE = "Events"

    def __init__(self) -> None:
        super().__init__(id="events", max_lines=KEPT, wrap=False, markup=False, min_width=20)
        self._events: deque[Event] = deque(maxlen=KEPT)
        self._filter = "info and up"
        self._counts = {"warning": 0, "error": 0}

    def on_mount(self) -> None:
        """Show the filter and the counts."""
        self._label()

    def add(self, events: list[Event]) -> None:
        """Append events, in order."""
        self._events.extend(events)
        for event in events:
            if event.level in self._counts:
                self._counts[event.level] += 1
            if self._passes(event):
                self.write(line_of(event))
        self._label()

    def restart(self) -> None:
        """Forget all events."""
        self._events.clear()
        self._counts = dict.fromkeys(self._counts, 0)
        self.clear()

    def next_filter(self) -> str:
        """Switch to the next filter, cyclically; return its name."""
        names = list(LEVELS)
        self._filter = names[(names.index(self._filter) + 1) % len(names)]
        self.clear()
        for event in self._events:
            if self._passes(event):
                self.write(line_of(event))
        self._label()
        return self._filter

    def _label(self) -> None:
        warnings, errors = self._counts["warning"], self._counts["error"]
        self.border_subtitle = (
            f"{self._filter}  [{css(WARN)}]▲[/] {warnings}  [{css(BAD)}]✘[/] {errors}"
        )

    def _passes(self, event: Event) -> bool:
        lowest = LEVELS[self._filter]
        if event.kind in ROUTINE and event.level == "info":
            return lowest < 0
        return RANK.get(event.level, 2) >= lowest


def line_of(event: Event) -> Text:
    """Return an event as a line: time, glyph, source, text."""
    glyph, colour = LEVEL_GLYPH.get(event.level, ("?", TEXT))
    line = Text(f"{clock(event.time)} ", style=css(DIM))
    line.append(f"{glyph} ", style=f"bold {css(colour)}")
    line.append(f"{one_line(event.source):<13}", style=css(DIM))
    line.append(one_line(event.text), style=css(TEXT if event.level == "info" else colour))
    return line
