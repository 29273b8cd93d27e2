"""Status bar: mission, state, time and running node; localisation, battery and speed."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import Static

from stack.telemetry.records import RunInfo, Snapshot, TreeRow
from tui.palette import (
    BAD,
    BUSY,
    DIM,
    GOOD,
    PANEL,
    STATE_COLOUR,
    STATE_GLYPH,
    TEXT,
    WARN,
    css,
    health_colour,
)

STALE_AFTER = 2.0
"""Wall seconds without a message after which the screen is marked as out of date."""


class StatusBar(Static):
    """One line with the state of the run."""

    def __init__(self) -> None:
        super().__init__(id="status")
        self._shown = Text()

    def show(self, snapshot: Snapshot | None, info: RunInfo | None, silent_for: float) -> None:
        """Show the state of a snapshot, or that the engine is awaited."""
        left = Text(f" ◆ {info.title if info else 'treepilot'}  ", style=f"bold {css(TEXT)}")
        right = Text()
        if snapshot is None:
            left.append(f"waiting for the engine, {silent_for:.0f} s", style=f"not bold {css(DIM)}")
        else:
            self._state(left, snapshot, silent_for)
            self._figures(right, snapshot)
        room = max(0, self.size.width - right.cell_len - 1)
        left.truncate(room, overflow="ellipsis", pad=True)
        left.append_text(right)
        if left != self._shown:
            self._shown = left
            self.update(left, layout=False)

    def _state(self, text: Text, snapshot: Snapshot, silent_for: float) -> None:
        state = str(snapshot.state)
        colour = css(STATE_COLOUR[state])
        text.append(f" {STATE_GLYPH[state]} {state.upper()} ", style=f"{css(PANEL)} on {colour}")
        minutes, seconds = divmod(snapshot.time, 60)
        text.append(f"  {int(minutes):02d}:{seconds:04.1f}", style=css(TEXT))
        if silent_for > STALE_AFTER and not snapshot.state.is_over:
            text.append(f"  no data for {silent_for:.0f} s", style=css(WARN))
        elif not snapshot.state.is_over and (row := deepest_running(snapshot.tree)) is not None:
            text.append(f"  {row.name}", style=f"not bold {css(BUSY)}")
            text.append(f"  {row.message}", style=f"not bold {css(DIM)}")

    def _figures(self, text: Text, snapshot: Snapshot) -> None:
        health, charge = snapshot.health, snapshot.battery.charge
        for label, value, colour in (
            ("loc", f"{health:.2f}", health_colour(health)),
            ("bat", f"{charge:.0%}", GOOD if charge > 0.4 else WARN if charge > 0.2 else BAD),
        ):
            text.append(f"  {label} ", style=css(DIM))
            text.append(value, style=css(colour))
        text.append(f"  {snapshot.speed:.1f}×", style=css(TEXT))


def deepest_running(tree: tuple[TreeRow, ...]) -> TreeRow | None:
    """Return the running node with the most ancestors, the first if there are several."""
    depth_of: dict[int, int] = {-1: -1}
    deepest: tuple[int, TreeRow] | None = None
    for row in tree:
        depth = depth_of[row.id] = depth_of.get(row.parent, -1) + 1
        if row.status == "running" and (deepest is None or depth > deepest[0]):
            deepest = depth, row
    return deepest[1] if deepest is not None else None
