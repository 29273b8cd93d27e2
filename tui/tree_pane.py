"""The behaviour tree, a line a node, following what runs."""

from __future__ import annotations

from rich.segment import Segment
from textual.strip import Strip
from textual.widget import Widget

from stack.telemetry.records import Snapshot, TreeRow
from tui import palette
from tui.strips import ink

KIND_GLYPH = {
    "sequence": "→", "reactive": "⇉", "fallback": "?", "reactive_fallback": "⁇", "parallel": "∥",
    "round_robin": "↻", "for_each": "∀", "retry": "↺", "recover": "✚", "timeout": "◷",
    "repeat": "⟳", "when": "⊳", "while": "⊚", "on_failure": "⊘", "check": "◇", "wait_until": "◇",
}  # fmt: skip


class TreePane(Widget, can_focus=True):
    """Draws the rows of a snapshot. Scrolls by itself until the operator scrolls."""

    BORDER_TITLE = "Mission tree"

    def __init__(self) -> None:
        super().__init__(id="tree")
        self._rows: tuple[TreeRow, ...] = ()
        self._depths: list[int] = []
        self._time = 0.0
        self._top = 0
        self._held = False

    def show(self, snapshot: Snapshot) -> None:
        """Draw the tree of a snapshot."""
        if snapshot.tree is not self._rows:
            self._rows = snapshot.tree
            self._depths = _depths(self._rows)
        self._time = snapshot.time
        if not self._held:
            self._follow()
        running = sum(row.status == "running" for row in self._rows)
        self.border_subtitle = f"{running} of {len(self._rows)} running"
        self.refresh()

    def scroll_by(self, lines: int) -> None:
        """Scroll by hand; `follow` gives the view back."""
        self._held = True
        self._top = max(0, min(self._top + lines, len(self._rows) - self.size.height))
        self.refresh()

    def follow(self) -> None:
        """Follow what runs again."""
        self._held = False
        self._follow()
        self.refresh()

    def on_mouse_scroll_down(self) -> None:
        """The wheel scrolls."""
        self.scroll_by(3)

    def on_mouse_scroll_up(self) -> None:
        """The wheel scrolls."""
        self.scroll_by(-3)

    def render_line(self, y: int) -> Strip:
        """One node."""
        width, index = self.size.width, self._top + y
        if not self._rows and y == self.size.height // 2:
            text = "waiting for the mission"
            return Strip([Segment(text.center(width), ink(palette.DIM, italic=True))])
        if index >= len(self._rows):
            return Strip.blank(width)
        row = self._rows[index]
        segments = [*self._line(row, self._depths[index])]
        return Strip(segments).crop(0, width).extend_cell_length(width)

    def _line(self, row: TreeRow, depth: int) -> list[Segment]:
        active = row.status == "running"
        colour = palette.STATUS_COLOUR[row.status]
        words = palette.TEXT if row.status != "idle" else palette.DIM
        message = self._message(row)
        return [
            Segment("│ " * depth, ink(palette.FAINT)),
            Segment(f"{palette.STATUS_GLYPH[row.status]} ", ink(colour, bold=True)),
            Segment(f"{KIND_GLYPH.get(row.kind, '⚙')} ", ink(palette.DIM)),
            Segment(row.name, ink(palette.BUSY if active else words, bold=active)),
            Segment(f"  {message}" if message else "", ink(palette.DIM, italic=True)),
        ]

    def _message(self, row: TreeRow) -> str:
        if row.status == "running" and self._time - row.since >= 1.0:
            took = f"{self._time - row.since:.0f} s"
            return f"{took}  {row.message}" if row.message else took
        return row.message if row.status != "idle" else ""

    def _follow(self) -> None:
        height = self.size.height
        running = [n for n, row in enumerate(self._rows) if row.status == "running"]
        if len(self._rows) <= height or not running:
            self._top = 0 if len(self._rows) <= height else self._top
            return
        deepest = running[-1]
        if not self._top + 2 <= deepest < self._top + height - 2:
            self._top = max(0, min(deepest - height // 2, len(self._rows) - height))


def _depths(rows: tuple[TreeRow, ...]) -> list[int]:
    depth_of: dict[int, int] = {-1: -1}
    for row in rows:
        depth_of[row.id] = depth_of.get(row.parent, -1) + 1
    return [depth_of[row.id] for row in rows]
