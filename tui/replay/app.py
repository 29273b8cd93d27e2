"""The dashboard of a recorded run."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widget import Widget
from textual.widgets import Input, Label, Static

from stack.telemetry.records import Snapshot
from tui.drawing.palette import BAD, DIM, css
from tui.keys import VIEW_KEYS, Key
from tui.link import Link
from tui.panes.events_pane import EventsPane
from tui.panes.map_pane import MapPane
from tui.panes.tree_pane import TreePane
from tui.replay.player import Player
from tui.replay.timeline import Timeline
from tui.run_view import RunView
from tui.sheets.whole_text import WholeText

REPLAY_KEYS = (
    Key("space,shift+space,p", "play", "Play", "play or pause", "space"),
    Key("comma", "step(-1)", "", "one snapshot back or forwards", ", ."),
    Key("full_stop", "step(1)"),
    Key("left_square_bracket", "skip(-5)", "", "5 s back or forwards; { } a minute", "[ ]"),
    Key("right_square_bracket", "skip(5)"),
    Key("left_curly_bracket", "skip(-60)"),
    Key("right_curly_bracket", "skip(60)"),
    Key("less_than_sign", "factor(0.5)", "", "play slower or faster", "< >"),
    Key("greater_than_sign", "factor(2.0)"),
    Key("n", "next_event(1)", "Event", "next event; N: the one before", "n N"),
    Key("N", "next_event(-1)"),
    Key("x", "next_failure(1)", "Failure",
        "next failure, doubt, failsafe or silent sensor; X: before", "x X"),
    Key("X", "next_failure(-1)"),
    Key("s", "next_change(1)", "", "next change of the selected node; S: the one before", "s S"),
    Key("S", "next_change(-1)"),
    Key("home", "skip(-1e9)", "", "to the beginning; end: to the end", "home end"),
    Key("end", "skip(1e9)"),
    Key("enter", "whole_text", "", "whole text of the selected node and the newest events"),
    Key("ctrl+c", "leave", everywhere=True),
    Key("colon", "go_to", "", "go to a time, as 83.5, 1:23 or 1:02:03", ":"),
)  # fmt: skip

_TIME = re.compile(r"(?:(?:(\d+):)?(\d+):)?(\d+(?:\.\d*)?)\s*s?")


def seconds_of(text: str) -> float | None:
    """Read 83.5, 1:23.5 or 1:02:03 as seconds; None if it is none of these."""
    found = _TIME.fullmatch(text.strip())
    if found is None:
        return None
    hours, minutes, seconds = (float(part or 0) for part in found.groups())
    return hours * 3600 + minutes * 60 + seconds


class AskTime(ModalScreen[float | None]):
    """Asks for a time of the run."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Back")]

    def compose(self) -> ComposeResult:
        """Compose the question."""
        with Vertical(classes="dialog editing"):
            yield Label("Go to", markup=False)
            yield Input(placeholder="83.5, 1:23 or 1:02:03")
            yield Static(f"[{css(DIM)}]enter goes there · esc cancels[/]", id="asked")

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return the time, or say that it is none."""
        time = seconds_of(event.value)
        if time is not None:
            self.dismiss(time)
        else:
            self.query_one("#asked", Static).update(
                f"[{css(BAD)}]expected seconds, minutes:seconds or hours:minutes:seconds[/]"
            )

    def action_cancel(self) -> None:
        """Go nowhere."""
        self.dismiss(None)


class ReplayDashboard(RunView, inherit_bindings=False):
    """Shows a recorded run. Nothing can be commanded; returns `leave`."""

    KEYS = (*REPLAY_KEYS, *VIEW_KEYS)
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in KEYS]

    def __init__(self, player: Player, *, live: bool = True) -> None:
        """Show a recording.

        Args:
            player: of the run; closed together with the dashboard.
            live: refresh by a timer. Tests disable it and call `refresh_now`.
        """
        super().__init__(player, live=live)
        self._player = player
        self._timeline = Timeline(player)

    def below_panes(self) -> list[Widget]:
        """The line of time."""
        return [self._timeline]

    def refresh_now(self) -> None:
        """Show the snapshot at the play head."""
        self.panes.query_one(MapPane).doors = self._player.doors_at_head()
        super().refresh_now()
        self._timeline.show()

    def past(self) -> Sequence[Snapshot] | None:
        """After a jump, the minute before the play head."""
        return self._player.land()

    def link(self) -> Link:
        return replace(super().link(), is_replay=True)

    def action_play(self) -> None:
        """Play or pause."""
        self._player.toggle()
        self.hurry()

    def action_step(self, count: int) -> None:
        """Pause, and step by snapshots."""
        self._player.step(count)
        self.hurry()

    def action_skip(self, seconds: float) -> None:
        """Move by a time."""
        self._player.seek(self._player.time + seconds)
        self.hurry()

    def action_factor(self, factor: float) -> None:
        """Play faster or slower."""
        self.notify(f"{self._player.change_speed(factor):g} × real time", timeout=1.5)
        self.hurry()

    def action_next_event(self, direction: int) -> None:
        """Go to the next event, or to the one before."""
        self._seek(self._player.moments.events, direction, "event")

    def action_next_failure(self, direction: int) -> None:
        """Go to the next failure of a node, error, doubt or failsafe, or to the one before."""
        self._seek(self._player.moments.failures, direction, "failure")

    def action_next_change(self, direction: int) -> None:
        """Go to the next change of the selected node, or to the one before."""
        row = self.panes.query_one(TreePane).chosen_row
        if row is not None:
            changes = self._player.changes_of(row.id)
            self._seek(changes, direction, f"change of {row.name}")

    def _seek(self, times: tuple[float, ...], direction: int, what: str) -> None:
        if not self._player.seek_next(times, direction):
            self.notify(f"no {what} {'after' if direction > 0 else 'before'} this", timeout=2.0)
        self.hurry()

    def action_go_to(self) -> None:
        """Ask for a time, and go there."""

        def answered(time: float | None) -> None:
            if time is not None:
                self._player.seek(time)
                self.hurry()

        self.push_screen(AskTime(), answered)

    def action_whole_text(self) -> None:
        """Show the texts that do not fit into their panes."""
        if self.snapshot is not None:
            row = self.panes.query_one(TreePane).chosen_row
            events = self.panes.query_one(EventsPane).shown
            self.push_screen(WholeText(self.snapshot.reason, row, events))

    def action_leave(self) -> None:
        """Leave at once."""
        self.exit("leave")
