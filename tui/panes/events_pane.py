"""Event log with a level filter."""

from __future__ import annotations

from collections import deque
from typing import ClassVar

from rich.markup import escape
from rich.segment import Segment
from rich.text import Text
from textual.binding import BindingType
from textual.strip import Strip
from textual.widgets import RichLog

from stack.telemetry.records import ROUTINE, Event
from tui.drawing.palette import BACKDROP, BAD, BUSY, DIM, GOOD, TEXT, WARN, css
from tui.drawing.strips import clock, hint, one_line
from tui.keys import FOUND_KEYS

LEVELS = {"everything": -1, "info and up": 0, "warnings and errors": 1, "errors": 2}
RANK = {"info": 0, "warning": 1, "error": 2}
LEVEL_GLYPH = {"info": ("·", GOOD), "warning": ("▲", WARN), "error": ("✘", BAD)}

KEPT = 2000


class EventsPane(RichLog):
    """Shows events as lines and keeps them, so that a new filter also applies to old events."""

    BORDER_TITLE = "Events"
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in FOUND_KEYS]

    def __init__(self) -> None:
        super().__init__(id="events", max_lines=KEPT, wrap=False, markup=False, min_width=20)
        self._events: deque[Event] = deque(maxlen=KEPT)
        self._filter = "info and up"
        self._counts = {"warning": 0, "error": 0}
        self._wanted = ""
        self._matches: list[int] = []
        self._match = 0

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
        if self._wanted:
            self._find()
        self._label()

    @property
    def shown(self) -> list[Event]:
        """The events that pass the filter, oldest first."""
        return [event for event in self._events if self._passes(event)]

    def restart(self) -> None:
        """Forget all events."""
        self._events.clear()
        self._counts = dict.fromkeys(self._counts, 0)
        self.clear()

    def next_filter(self) -> str:
        """Switch to the next filter, cyclically; return its name."""
        names = list(LEVELS)
        self._filter = names[(names.index(self._filter) + 1) % len(names)]
        self._rewrite()
        return self._filter

    def search(self, text: str) -> bool:
        """Show the newest event with a text; return whether there is one."""
        self._wanted = text.lower()
        self._find()
        self._match = len(self._matches) - 1
        if not self._matches:
            self._wanted = ""
        self._rewrite()
        return bool(self._matches)

    def action_next_match(self, direction: int) -> None:
        """Go to the next match, cyclically."""
        if self._matches:
            self._match = (self._match + direction) % len(self._matches)
            self._show_match()

    def action_end_search(self) -> None:
        """End the search, and follow the newest event."""
        self._wanted, self._matches = "", []
        self.auto_scroll = True
        self._rewrite()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave the keys to the dashboard while nothing is searched."""
        return bool(self._wanted) or action not in {"next_match", "end_search"}

    def render_line(self, y: int) -> Strip:
        """Return one line; the end of a longer one is an ellipsis."""
        if not self.lines and y == 0:
            none = (
                f"no event passes the filter: {self._filter}" if self._events else "no events yet"
            )
            return hint(none.ljust(self.size.width))
        line, number = super().render_line(y), self.scroll_offset.y + y
        if number >= len(self.lines) or self.lines[number].cell_length <= line.cell_length:
            return line
        cut = line.crop(0, max(0, line.cell_length - 1))
        style = next((segment.style for segment in reversed(list(cut)) if segment.style), None)
        return Strip([*cut, Segment("…", style)])

    def _find(self) -> None:
        lines = [line_of(event).plain.lower() for event in self._events if self._passes(event)]
        self._matches = [number for number, line in enumerate(lines) if self._wanted in line]

    def _rewrite(self) -> None:
        """Write all lines again, with the matches marked."""
        self.clear()
        for event in self._events:
            if self._passes(event):
                line = line_of(event)
                if self._wanted:
                    mark = f"{css(BACKDROP)} on {css(WARN)}"
                    line.highlight_words([self._wanted], mark, case_sensitive=False)
                self.write(line, scroll_end=not self._wanted)
        if self._wanted:
            self._find()
            self._match = min(self._match, len(self._matches) - 1)
            self._show_match()
        self._label()

    def _show_match(self) -> None:
        self.auto_scroll = False
        if self._matches:
            line = self._matches[self._match] - self.size.height // 2
            self.scroll_to(y=max(0, line), animate=False)
        self._label()

    def _label(self) -> None:
        warnings, errors = self._counts["warning"], self._counts["error"]
        found = ""
        if self._wanted:
            count = f"{self._match + 1} of {len(self._matches)}" if self._matches else "none"
            found = f"[{css(BUSY)}]/{escape(one_line(self._wanted))}[/] {count}, n N esc  "
        label = f"{found}{self._filter}  [{css(WARN)}]▲[/] {warnings}  [{css(BAD)}]✘[/] {errors}"
        self.border_subtitle = label

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
