"""The event log, with a level filter."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import RichLog

from stack.telemetry.records import Event
from tui.palette import BAD, DIM, GOOD, TEXT, WARN, css

LEVELS = ("debug", "info", "warning", "error")
LEVEL_COLOUR = {"debug": DIM, "info": GOOD, "warning": WARN, "error": BAD}
QUIET = frozenset({"pose", "node_status"})


class EventsPane(RichLog):
    """Lines as they come; kept, so that a change of filter shows the past as well."""

    BORDER_TITLE = "Events"

    def __init__(self) -> None:
        super().__init__(id="events", max_lines=2000, wrap=False, markup=False, min_width=20)
        self._events: list[Event] = []
        self._level = "info"

    def add(self, events: list[Event]) -> None:
        """Append events, in order."""
        self._events.extend(events)
        for event in events:
            if self._passes(event):
                self.write(self._line(event))

    def next_level(self) -> str:
        """Show more or less: info, warning, error, everything, and round again."""
        self._level = LEVELS[(LEVELS.index(self._level) + 1) % len(LEVELS)]
        self.clear()
        for event in self._events[-2000:]:
            if self._passes(event):
                self.write(self._line(event))
        self.border_subtitle = "everything" if self._level == "debug" else f"{self._level} and up"
        return self._level

    def _passes(self, event: Event) -> bool:
        if self._level == "debug":
            return True
        if event.kind in QUIET and event.level in ("debug", "info"):
            return False
        return LEVELS.index(event.level) >= LEVELS.index(self._level)

    def _line(self, event: Event) -> Text:
        minutes, seconds = divmod(event.time, 60.0)
        line = Text(f"{int(minutes):02d}:{seconds:04.1f} ", style=css(DIM))
        line.append(f"{event.level.upper():<8}", style=css(LEVEL_COLOUR.get(event.level, TEXT)))
        line.append(f"{event.source:<13}", style=css(DIM))
        line.append(event.text, style=css(TEXT))
        return line
