"""Behaviour tree, one line per node, with the details of the selected node below."""

from __future__ import annotations

from collections.abc import Iterable
from textwrap import wrap
from typing import Any, ClassVar

from rich.cells import cell_len, set_cell_size
from rich.segment import Segment
from rich.style import Style
from textual.binding import BindingType
from textual.message import Message
from textual.strip import Strip

from stack.telemetry.records import Debugging, Event, Snapshot, TreeRow
from stack.telemetry.tree_text import STATUS_GLYPH
from tui.drawing import palette
from tui.drawing.strips import Lines, ink, one_line, paper
from tui.keys import TREE_KEYS
from tui.screens import Question

DETAIL_LINES, DETAIL_FROM = 3, 11
"""Lines for the selected node, and the smallest height of a pane that shows them."""

LEAST_NAME = 6
"""Columns below which the name is left out of the title of these lines."""

AGE_FROM = 1.0
"""Seconds from which the age of a running node is shown."""


class TreePane(Lines, can_focus=True):
    """Draws the tree of a snapshot; follows the running node until the operator selects one."""

    BORDER_TITLE = "Mission tree"
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in TREE_KEYS]

    class CommandRequest(Message):
        """Request to send a command to the engine: its kind and arguments."""

        def __init__(self, kind: str, arguments: dict[str, Any]) -> None:
            super().__init__()
            self.kind, self.arguments = kind, arguments

    def __init__(self, *, debugs: bool = True) -> None:
        """Create the pane.

        Args:
            debugs: whether it takes breakpoints, steps and forced outcomes.
        """
        super().__init__(id="tree")
        self._debugs = debugs
        self.chosen = 0
        self.top = 0
        self.pinned = False
        self._rows: tuple[TreeRow, ...] = ()
        self._stems: list[str] = []
        self._time = 0.0
        self._places: dict[int, str] = {}
        self._debugging: Debugging | None = None
        self._subtitle = ""

    def show(self, snapshot: Snapshot) -> bool:
        """Draw the tree of a snapshot; return whether the mission was reloaded since the last."""
        before, self._debugging = self._debugging, snapshot.debugging
        replaced = before is not None and before.generation != snapshot.debugging.generation
        if replaced:
            self.pinned = False
        if snapshot.tree != self._rows:
            self._rows = snapshot.tree
            self._stems = stems(self._rows)
        self._time = snapshot.time
        counts = self._counts()
        if counts != self._subtitle:
            self.border_subtitle = self._subtitle = counts
        self._redraw()
        return replaced

    def take(self, events: Iterable[Event]) -> None:
        """Take from the log where each node stands in the mission's files."""
        for event in events:
            if event.kind == "tree":
                rows = event.fields.get("rows", ())
                self._places = {int(row[0]): str(row[4]) for row in rows}

    def choose(self, lines: int) -> None:
        """Select the node `lines` further down, and stop following the running node."""
        self.pinned = True
        self.chosen = max(0, min(self.chosen + lines, len(self._rows) - 1))
        self._redraw()

    def follow(self) -> None:
        """Follow the running node."""
        self.pinned = False
        self._redraw()

    def action_breakpoint(self) -> None:
        """Set or remove a breakpoint at the selected node."""
        row, debugging = self.chosen_row, self._debugging
        if row is not None and debugging is not None:
            self._request("unbreak" if row.id in debugging.breakpoints else "break", row)

    def action_step(self) -> None:
        """Continue for one tick."""
        self.post_message(self.CommandRequest("step", {"ticks": 1}))

    def action_continue(self) -> None:
        """Continue after a breakpoint, a step or a pause."""
        self.post_message(self.CommandRequest("continue", {}))

    def action_force(self) -> None:
        """Ask for the forced outcome of the selected node."""
        row, debugging = self.chosen_row, self._debugging
        if row is None or debugging is None:
            return
        answers = {
            "": "Cancel",
            "success": "Success, at once, whenever it is ticked",
            "failure": "Failure, at once, whenever it is ticked",
        }
        if str(row.id) in debugging.forced:
            answers["off"] = "Off: let it run again"
        if row.kind == "event":
            answers["due"] = "Due: trigger the event now, once"

        def answered(status: str | None) -> None:
            if status:
                self._request("force", row, status=status)

        self.app.push_screen(
            Question(f"Force the outcome of {one_line(row.name)}?", answers), answered
        )

    def _request(self, kind: str, row: TreeRow, **more: str) -> None:
        generation = self._debugging.generation if self._debugging else 0
        arguments = {"node": str(row.id), "generation": generation, **more}
        self.post_message(self.CommandRequest(kind, arguments))

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Leave the keys of debugging to others where nothing can be debugged."""
        return self._debugs or action not in {key.action for key in TREE_KEYS}

    @property
    def chosen_row(self) -> TreeRow | None:
        """The selected node."""
        return self._rows[min(self.chosen, len(self._rows) - 1)] if self._rows else None

    def on_resize(self) -> None:
        """Keep the selected node visible."""
        self._redraw()

    def on_focus(self) -> None:
        """Mark the selected node."""
        self._redraw()

    def on_blur(self) -> None:
        """Mark the selected node only if it is pinned."""
        self._redraw()

    def on_mouse_scroll_down(self) -> None:
        """Select a node further down."""
        self.choose(3)

    def on_mouse_scroll_up(self) -> None:
        """Select a node further up."""
        self.choose(-3)

    @property
    def list_height(self) -> int:
        """Lines available for nodes."""
        height = self.size.height
        return height - DETAIL_LINES if height >= DETAIL_FROM else height

    def _redraw(self) -> None:
        self._update_selection()
        self.put([self._drawn(y) for y in range(self.size.height)])

    def _drawn(self, y: int) -> Strip:
        """Return the line of a node, or of the details."""
        width = self.size.width
        if not self._rows:
            text = "waiting for the mission" if y == self.size.height // 2 else ""
            strip = Strip([Segment(text.center(width), ink(palette.DIM, italic=True))])
            return strip.apply_style(paper(palette.BACKDROP))
        if y >= self.list_height:
            strip = self._detail(y - self.list_height, width)
        elif self.top + y < len(self._rows):
            strip = self._line(self.top + y, width)
        else:
            strip = Strip.blank(width)
        return strip.apply_style(paper(palette.BACKDROP))

    def _line(self, index: int, width: int) -> Strip:
        row = self._rows[index]
        active = row.status == "running"
        words = palette.IDLE if row.status == "idle" else palette.TEXT
        age = self._age(row)
        room = width - cell_len(self._stems[index]) - 4 - len(age)
        name = _shortened(one_line(row.name), room)
        room -= cell_len(name)
        message = self._message(row)
        shown = f"  {_shortened(message, room - 2)}" if message and room > 6 else ""
        segments = [
            Segment(self._stems[index], ink(palette.FAINT)),
            *self._head(row),
            Segment(f"{row.glyph} ", ink(palette.DIM)),
            Segment(name, ink(palette.BUSY if active else words, bold=active)),
            Segment(set_cell_size(shown, room), self._message_style(row)),
            Segment(age, ink(palette.DIM)),
        ]
        back = palette.ACTIVE_ROW if active else None
        if index == self.chosen and (self.pinned or self.has_focus):
            back = palette.CHOSEN_ROW
        strip = Strip(segments).crop(0, width)
        return strip if back is None else strip.apply_style(paper(back))

    def _head(self, row: TreeRow) -> list[Segment]:
        """Return the glyphs of the status and of a breakpoint or forced outcome."""
        glyph, style = STATUS_GLYPH[row.status], palette.STATUS_COLOUR[row.status]
        mark, colour = self._mark(row)
        if not mark:
            return [Segment(f"{glyph} ", ink(style, bold=True))]
        return [Segment(glyph, ink(style, bold=True)), Segment(mark, ink(colour, bold=True))]

    def _detail(self, line: int, width: int) -> Strip:
        row = self._rows[min(self.chosen, len(self._rows) - 1)]
        if line == 0:
            title = f"─╴{self._title(row, width - 4)}╶"
            return Strip(
                [Segment(set_cell_size(title.ljust(width, "─"), width), ink(palette.IDLE))]
            )
        duration = f" for {self._time - row.since:.0f} s" if row.status == "running" else ""
        status = f"{row.status}{duration}"
        status = (
            "stopped before this node; starts with the next tick" if self._is_held(row) else status
        )
        words = one_line(self._forced(row) or row.message or status)
        lines = wrap(words, max(8, width - 2), max_lines=DETAIL_LINES - 1, placeholder="…")
        text = f" {lines[line - 1]}" if line <= len(lines) else ""
        return Strip([Segment(set_cell_size(text, width), self._message_style(row))])

    def _title(self, row: TreeRow, room: int) -> str:
        """Name and kind if there is room, the line of the mission, and whether it stops there."""
        name = one_line(row.name if row.name == row.kind else f"{row.name} · {row.kind}")
        place, mark = self._places.get(row.id, ""), "breakpoint" * (self._mark(row)[0] == "●")
        right = " · ".join(filter(None, (one_line(place), mark)))
        left = room - cell_len(right) - 3
        if not right:
            return _shortened(name, room)
        if left >= LEAST_NAME:
            return f"{_shortened(name, left)} · {right}"
        return right if cell_len(right) <= room else f"…{right[-max(1, room - 1) :]}"

    def _message_style(self, row: TreeRow) -> Style:
        failed = row.status == "failure"
        return ink(palette.FAILED_MESSAGE if failed else palette.DIM, italic=True)

    def _message(self, row: TreeRow) -> str:
        """Return the text after the name."""
        if self._is_held(row):
            return "starts next"
        return one_line(self._forced(row) or (row.message if row.status != "idle" else ""))

    def _is_held(self, row: TreeRow) -> bool:
        return self._debugging is not None and row.id in self._debugging.held

    def _forced(self, row: TreeRow) -> str:
        forced = self._debugging.forced.get(str(row.id)) if self._debugging is not None else None
        return f"forced: {forced}" if forced else ""

    def _mark(self, row: TreeRow) -> tuple[str, int]:
        """Return the glyph and colour of a breakpoint or forced outcome, or no glyph."""
        if self._debugging is not None and row.id in self._debugging.breakpoints:
            return "●", palette.BAD
        return ("◆", palette.WARN) if self._forced(row) else ("", palette.DIM)

    def _age(self, row: TreeRow) -> str:
        age = self._time - row.since
        return f" {age:.0f} s " if row.status == "running" and age >= AGE_FROM else ""

    def _counts(self) -> str:
        counted = {status: 0 for status in ("success", "failure", "running")}
        for row in self._rows:
            if row.status in counted:
                counted[row.status] += 1
        shown = "  ".join(
            f"[{palette.css(palette.STATUS_COLOUR[status])}]{STATUS_GLYPH[status]}[/] {n}"
            for status, n in counted.items()
        )
        return f"{shown}  of {len(self._rows)}"

    def _stopped_at(self) -> int | None:
        """Return the index of the node at which the mission is stopped."""
        held = self._debugging.held if self._debugging is not None else ()
        found = (index for index, row in enumerate(self._rows) if row.id in held)
        return next(found, None)

    def _update_selection(self) -> None:
        """Select the running node unless pinned; scroll to keep the selected node visible."""
        if not self.pinned:
            self.chosen = self._stopped_at() or default_selection(self._rows)
        height = max(1, self.list_height)
        margin = min(2, (height - 1) // 2)
        lowest = max(0, len(self._rows) - height)
        if self.chosen < self.top + margin:
            self.top = self.chosen - margin
        elif self.chosen >= self.top + height - margin:
            self.top = self.chosen - height + margin + 1
        self.top = max(0, min(self.top, lowest))


def stems(rows: tuple[TreeRow, ...]) -> list[str]:
    """Return the lines that connect each row to its parent, two characters per level."""
    last_child = {row.parent: row.id for row in rows}
    below: dict[int, str] = {}
    drawn = []
    for row in rows:
        if row.parent not in below:
            drawn.append("")
            below[row.id] = ""
            continue
        is_last = last_child[row.parent] == row.id
        drawn.append(below[row.parent] + ("└─" if is_last else "├─"))
        below[row.id] = below[row.parent] + ("  " if is_last else "│ ")
    return drawn


def default_selection(rows: tuple[TreeRow, ...]) -> int:
    """Return the index of the deepest running node, else of the cause of the root's failure."""
    for status in ("running", "failure"):
        depth_of: dict[int, int] = {-1: 0}
        best, deepest = 0, 0
        for index, row in enumerate(rows):
            if row.status == status and row.parent in depth_of:
                depth_of[row.id] = depth_of[row.parent] + 1
                if depth_of[row.id] > deepest:
                    best, deepest = index, depth_of[row.id]
        if deepest:
            return best
    return 0


def _shortened(text: str, room: int) -> str:
    if cell_len(text) <= room:
        return text
    return f"{set_cell_size(text, max(0, room - 1))}…" if room > 0 else ""
