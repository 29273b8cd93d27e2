"""The top line: mission, state in one word and why, time, battery, speed."""

from __future__ import annotations

from rich.text import Text
from textual.widgets import Static

from stack.telemetry.records import RunInfo, Snapshot
from tui.palette import BAD, DIM, GOOD, STATE_COLOUR, TEXT, WARN, css

STALE_AFTER = 2.0
"""Wall seconds of silence after which the picture is said to be old."""


class StatusBar(Static):
    """One line that says how it goes."""

    def __init__(self) -> None:
        super().__init__(id="status")

    def show(self, snapshot: Snapshot | None, info: RunInfo | None, silent_for: float) -> None:
        """Show a snapshot's state, or what is waited for."""
        text = Text(no_wrap=True, overflow="ellipsis")
        text.append(f" ◆ {info.title if info else 'treepilot'}  ", style=f"bold {css(TEXT)}")
        if snapshot is None:
            text.append(f"waiting for the engine, {silent_for:.0f} s", style=css(DIM))
        else:
            self._state(text, snapshot, silent_for)
        self.update(text)

    def _state(self, text: Text, snapshot: Snapshot, silent_for: float) -> None:
        colour = STATE_COLOUR.get(str(snapshot.state), DIM)
        text.append(f" {str(snapshot.state).upper()} ", style=f"bold #0b111c on {css(colour)}")
        minutes, seconds = divmod(snapshot.time, 60)
        text.append(f"  {int(minutes):02d}:{seconds:04.1f}", style=css(TEXT))
        text.append(f"  {snapshot.speed:.1f}×", style=css(DIM))
        charge = snapshot.battery.charge
        battery = GOOD if charge > 0.4 else WARN if charge > 0.2 else BAD
        text.append("  bat ", style=css(DIM))
        text.append(f"{charge:.0%}", style=css(battery))
        if silent_for > STALE_AFTER and not snapshot.state.is_over:
            text.append(f"  no news for {silent_for:.0f} s", style=f"bold {css(WARN)}")
        if snapshot.reason:
            text.append(f"  {snapshot.reason}", style=css(colour))
        elif running := [row for row in snapshot.tree if row.status == "running"]:
            text.append(f"  {running[-1].name} {running[-1].message}", style=css(DIM))
