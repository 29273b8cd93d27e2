"""Status bar: mission, state, time and running node; localisation, battery and speed."""

from __future__ import annotations

from rich.text import Text

from stack.telemetry.records import RunInfo, Snapshot
from stack.telemetry.tree_text import deepest_running
from tui.drawing.palette import (
    BUSY,
    DIM,
    PANEL,
    PATH,
    TEXT,
    TONES,
    WARN,
    charge_colour,
    css,
    health_colour,
)
from tui.drawing.strips import TextLines, clock, one_line
from tui.link import STALE_AFTER, Link
from tui.panes.header import header


class StatusBar(TextLines):
    """One line with the state of the run."""

    def __init__(self) -> None:
        super().__init__(id="status")
        self._shown = Text()
        self._last: tuple[Snapshot | None, RunInfo | None, Link] | None = None

    def show(self, snapshot: Snapshot | None, info: RunInfo | None, link: Link) -> None:
        """Show the state of a snapshot, or that the engine is awaited."""
        self._last = snapshot, info, link
        width, right = self.size.width, Text()
        if snapshot is not None:
            self._figures(right, snapshot, info)
        title = one_line(info.title) if info else "treepilot"
        left = self._state(f" ◆ {title} ", snapshot, link)
        if left.cell_len + right.cell_len >= width:
            left = self._state("", snapshot, link)
        if left.cell_len + right.cell_len >= width:
            right = Text()
        if snapshot is not None and link.silent_for <= STALE_AFTER:
            self._doing(left, snapshot)
        left.truncate(max(0, width - right.cell_len - 1), overflow="ellipsis", pad=True)
        left.append_text(right)
        if left != self._shown:
            self._shown = left
            self.put_text(left)

    def on_resize(self) -> None:
        """Use the new width."""
        if self._last is not None:
            self.show(*self._last)

    def _state(self, title: str, snapshot: Snapshot | None, link: Link) -> Text:
        """Return what happens, the alarms and the time."""
        text, now = Text(title, style=f"bold {css(TEXT)}"), header(snapshot, link)
        if link.is_replay:
            text.append(" REPLAY ", style=f"bold {css(PANEL)} on {css(PATH)}").append(" ")
        text.append(f" {now.words} ", style=f"bold {css(PANEL)} on {css(TONES[now.tone])}")
        for alarm in now.alarms:
            text.append(" ").append(f" ▲ {alarm} ", style=f"bold {css(PANEL)} on {css(WARN)}")
        if snapshot is not None:
            text.append(f"  {clock(snapshot.time)}", style=f"not bold {css(TEXT)}")
        over = link.is_over or (snapshot is not None and snapshot.state.is_over)
        if link.silent_for > STALE_AFTER and not over:
            text.append(f"  no data for {link.silent_for:.0f} s", style=f"not bold {css(WARN)}")
        return text

    def _doing(self, text: Text, snapshot: Snapshot) -> None:
        """Append what holds the robot, or else the running node."""
        if snapshot.state.is_over:
            return
        holds = next((one for one in snapshot.limitations if one.stands), None)
        if holds is not None:
            text.append(f"  held: {one_line(holds.detail)}", style=f"not bold {css(WARN)}")
        elif (row := deepest_running(snapshot.tree)) is not None:
            text.append(f"  {one_line(row.name)}", style=f"not bold {css(BUSY)}")
            text.append(f"  {one_line(row.message)}", style=f"not bold {css(DIM)}")

    def _figures(self, text: Text, snapshot: Snapshot, info: RunInfo | None) -> None:
        health, charge = snapshot.health, snapshot.battery.charge
        figures = [("bat", f"{charge:.0%}", charge_colour(charge))]
        if info is None or info.drives:
            colour = health_colour(health, snapshot.health_thresholds)
            figures.insert(0, ("loc", f"{health:.2f}", colour))
        for label, value, colour in figures:
            text.append(f"  {label} ", style=css(DIM))
            text.append(value, style=css(colour))
        text.append(f"  {snapshot.speed:.1f}×", style=css(TEXT))
