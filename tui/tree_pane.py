"""The behaviour tree, a line a node, following what runs; the chosen node in full below."""

from __future__ import annotations

from textwrap import wrap

from rich.cells import cell_len, set_cell_size
from rich.segment import Segment
from rich.style import Style
from textual.strip import Strip
from textual.widget import Widget

from stack.telemetry.records import Snapshot, TreeRow
from tui import palette
from tui.strips import ink, paper

KIND_GLYPH = {
    "sequence": "→", "reactive": "⇉", "fallback": "?", "reactive_fallback": "⁇", "parallel": "∥",
    "round_robin": "↻", "for_each": "∀", "follow_waypoints": "⚑", "retry": "↺", "recover": "✚",
    "timeout": "◷", "repeat": "⟳", "when": "⊳", "while": "⊚", "on_failure": "⊘",
    "check": "◇", "wait_until": "◇",
}  # fmt: skip

DETAIL_LINES, DETAIL_FROM = 3, 11
"""Lines for the chosen node, in panes of at least so many lines."""

SHOWN_FROM = 1.0
"""Seconds after which a running node's age is worth a word."""


class TreePane(Widget, can_focus=True):
    """Draws the rows of a snapshot; follows what runs until the operator chooses a node."""

    BORDER_TITLE = "Mission tree"

    def __init__(self) -> None:
        super().__init__(id="tree")
        self.chosen = 0
        self.top = 0
        self.held = False
        self._rows: tuple[TreeRow, ...] = ()
        self._stems: list[str] = []
        self._time = 0.0

    def show(self, snapshot: Snapshot) -> None:
        """Draw the tree of a snapshot."""
        if snapshot.tree != self._rows:
            self._rows = snapshot.tree
            self._stems = stems(self._rows)
        self._time = snapshot.time
        self._settle()
        self.border_subtitle = self._counts()
        self.refresh()

    def choose(self, lines: int) -> None:
        """Choose the node so many lines farther down; `follow` gives the choice back."""
        self.held = True
        self.chosen = max(0, min(self.chosen + lines, len(self._rows) - 1))
        self._settle()
        self.refresh()

    def follow(self) -> None:
        """Follow what runs again."""
        self.held = False
        self._settle()
        self.refresh()

    def on_resize(self) -> None:
        """Keep the chosen node in sight."""
        self._settle()

    def on_mouse_scroll_down(self) -> None:
        """The wheel moves on."""
        self.choose(3)

    def on_mouse_scroll_up(self) -> None:
        """The wheel moves back."""
        self.choose(-3)

    @property
    def list_height(self) -> int:
        """Lines for the nodes."""
        height = self.size.height
        return height - DETAIL_LINES if height >= DETAIL_FROM else height

    def render_line(self, y: int) -> Strip:
        """One node, or a line about the chosen one."""
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
        head = f"{palette.STATUS_GLYPH[row.status]} "
        room = width - cell_len(self._stems[index]) - 4 - len(age)
        name = _fitted(row.name, room)
        room -= cell_len(name)
        said = f"  {_fitted(row.message, room - 2)}" if self._speaks(row) and room > 6 else ""
        segments = [
            Segment(self._stems[index], ink(palette.FAINT)),
            Segment(head, ink(palette.STATUS_COLOUR[row.status], bold=True)),
            Segment(f"{KIND_GLYPH.get(row.kind, '⚙')} ", ink(palette.DIM)),
            Segment(name, ink(palette.BUSY if active else words, bold=active)),
            Segment(set_cell_size(said, room), self._message_style(row)),
            Segment(age, ink(palette.DIM)),
        ]
        back = palette.ACTIVE_ROW if active else None
        if index == self.chosen and (self.held or self.has_focus):
            back = palette.CHOSEN_ROW
        strip = Strip(segments).crop(0, width)
        return strip if back is None else strip.apply_style(paper(back))

    def _detail(self, line: int, width: int) -> Strip:
        row = self._rows[min(self.chosen, len(self._rows) - 1)]
        if line == 0:
            title = _fitted(f"╴{row.name} · {row.kind}╶", width - 2)
            return Strip([Segment(f"─{title}".ljust(width, "─"), ink(palette.IDLE))])
        took = f" for {self._time - row.since:.0f} s" if row.status == "running" else ""
        words = row.message or f"{'not yet' if row.status == 'idle' else row.status}{took}"
        lines = wrap(words, max(8, width - 2), max_lines=DETAIL_LINES - 1, placeholder="…")
        text = f" {lines[line - 1]}" if line <= len(lines) else ""
        return Strip([Segment(set_cell_size(text, width), self._message_style(row))])

    def _message_style(self, row: TreeRow) -> Style:
        failed = row.status == "failure"
        return ink(palette.FAILED_WORDS if failed else palette.DIM, italic=True)

    def _speaks(self, row: TreeRow) -> bool:
        return bool(row.message) and row.status != "idle"

    def _age(self, row: TreeRow) -> str:
        age = self._time - row.since
        return f" {age:.0f} s " if row.status == "running" and age >= SHOWN_FROM else ""

    def _counts(self) -> str:
        counted = {status: 0 for status in ("success", "failure", "running")}
        for row in self._rows:
            if row.status in counted:
                counted[row.status] += 1
        shown = "  ".join(
            f"[{palette.css(palette.STATUS_COLOUR[status])}]{palette.STATUS_GLYPH[status]}[/] {n}"
            for status, n in counted.items()
        )
        return f"{shown}  of {len(self._rows)}"

    def _settle(self) -> None:
        """Choose what runs unless held; scroll as little as keeps the chosen node in sight."""
        if not self.held:
            self.chosen = of_interest(self._rows)
        height = max(1, self.list_height)
        margin = min(2, (height - 1) // 2)
        lowest = max(0, len(self._rows) - height)
        if self.chosen < self.top + margin:
            self.top = self.chosen - margin
        elif self.chosen >= self.top + height - margin:
            self.top = self.chosen - height + margin + 1
        self.top = max(0, min(self.top, lowest))


def stems(rows: tuple[TreeRow, ...]) -> list[str]:
    """The lines that join each row to its parent, two characters a level."""
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


def of_interest(rows: tuple[TreeRow, ...]) -> int:
    """Index of the deepest running node; when none runs, of the failure that failed the root."""
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


def _fitted(text: str, room: int) -> str:
    if cell_len(text) <= room:
        return text
    return f"{set_cell_size(text, max(0, room - 1))}…" if room > 0 else ""
