"""The line of time of a replay: where the play head is, and when something happened."""

from __future__ import annotations

from rich.text import Text
from textual.events import Click

from tui.drawing.palette import BAD, BUSY, DIM, PATH, TEXT, WARN, css
from tui.drawing.strips import TextLines, clock
from tui.replay.player import Player

SHORTEST = 10
"""Columns below which the line itself is left out."""


class Timeline(TextLines):
    """One line: play or pause, time, speed, and the run with its warnings and failures."""

    def __init__(self, player: Player) -> None:
        super().__init__(id="timeline")
        self._player = player
        self._shown, self._columns = Text(), 0

    def show(self) -> None:
        """Draw the present state."""
        player = self._player
        glyph = "▶" if player.is_playing else "‖"
        text = Text(f" {glyph} ", style=f"bold {css(BUSY)}")
        text.append(f"{clock(player.time)} / {clock(player.end)}", style=f"not bold {css(TEXT)}")
        text.append(f"  {player.factor:g}× ", style=css(DIM))
        if not player.recording.is_complete:
            text.append("still written ", style=css(WARN))
        room = self.size.width - text.cell_len - 1
        self._columns = room if room >= SHORTEST else 0
        if self._columns:
            text.append_text(self._line(self._columns))
        if text != self._shown:
            self._shown = text
            self.put_text(text)

    def on_resize(self) -> None:
        """Use the new width."""
        self._shown = Text()
        self.show()

    def on_click(self, event: Click) -> None:
        """Jump to the time under the pointer."""
        at = event.x - (self._shown.cell_len - self._columns)
        if self._columns and at >= 0:
            player = self._player
            player.seek(player.begin + (player.end - player.begin) * at / (self._columns - 1))

    def _line(self, columns: int) -> Text:
        """The run as a line: played, to come, marks, head."""
        player = self._player
        span = max(player.end - player.begin, 1e-9)

        def column(time: float) -> int:
            return round((time - player.begin) / span * (columns - 1))

        head = column(player.time)
        cells = [("━", PATH) if at <= head else ("─", DIM) for at in range(columns)]
        for time in player.moments.warnings:
            cells[column(time)] = ("▲", WARN)
        for time in player.moments.failures:
            cells[column(time)] = ("✘", BAD)
        cells[head] = ("●", TEXT)
        line = Text()
        for glyph, colour in cells:
            line.append(glyph, style=css(colour))
        return line
