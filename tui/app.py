"""The dashboard: tree, map, vitals, charts and events of one run, and the keys to steer it.

It is a client of telemetry and nothing else; closing it never stops a mission unless asked.
"""

from __future__ import annotations

from typing import ClassVar
from uuid import uuid4

from textual.app import App, ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.widgets import Footer

from stack.telemetry.records import Command, MissionState, Snapshot
from tui import palette
from tui.chart import Chart
from tui.events_pane import EventsPane
from tui.keys import KEYS
from tui.map_pane import MapPane
from tui.screens import Help, Question
from tui.source import Source
from tui.status_bar import StatusBar
from tui.tree_pane import TreePane
from tui.vitals_pane import VitalsPane

REFRESH = 0.1
PANES = ("tree", "map", "vitals", "events")


class Dashboard(App[str]):
    """Shows a run until the operator leaves; returns `over`, `leave` or `abort`."""

    CSS_PATH = "app.tcss"
    TITLE = "treepilot"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS: ClassVar[list[tuple[int, str]] | None] = [
        (0, "-small"), (96, "-narrow"), (124, "-wide"),
    ]  # fmt: skip
    VERTICAL_BREAKPOINTS: ClassVar[list[tuple[int, str]] | None] = [(0, "-short"), (34, "-tall")]
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in KEYS]

    def __init__(self, source: Source, *, live: bool = True) -> None:
        """Watch a source.

        Args:
            source: the run; closed with the dashboard.
            live: refresh by a timer. Tests switch it off and call `refresh_now`.
        """
        super().__init__()
        self.source, self._live = source, live
        self.snapshot: Snapshot | None = None
        self._speed_factor = 1.0

    def compose(self) -> ComposeResult:
        """Panes from left to right, the log below."""
        yield StatusBar()
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield TreePane()
                yield VitalsPane()
            yield MapPane()
            with Vertical(id="right"):
                speeds = {"wanted": palette.LOCAL_PLAN, "driven": palette.PATH}
                yield Chart("Speed", "m/s", speeds, 0.0, 0.2)
                yield Chart("Localisation", "", {"fit": palette.PARTICLE}, 0.0, 1.0)
                yield Chart("Error", "m", {"error": palette.PERSON}, 0.0, 0.05)
        yield EventsPane()
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Begin to watch."""
        self.query_one(MapPane).focus()
        if self._live:
            self.set_interval(REFRESH, self.refresh_now)

    def on_unmount(self) -> None:
        """Let go of the run."""
        self.source.close()

    def refresh_now(self) -> None:
        """Take what is new and show it."""
        snapshot, events = self.source.poll(), self.source.events()
        for ack in self.source.acks():
            if not ack.done:
                self.notify(ack.reason, severity="warning", title="refused")
        if events:
            self._panes().query_one(EventsPane).add(events)
        base = self._panes()
        shown = snapshot or self.snapshot
        base.query_one(StatusBar).show(shown, self.source.info, self.source.silent_for)
        if snapshot is not None:
            self.snapshot = snapshot
            self._show(snapshot)

    def _panes(self):  # type: ignore[no-untyped-def]
        """The screen with the panes, whatever lies over it."""
        return self.screen_stack[0]

    def _show(self, snapshot: Snapshot) -> None:
        base = self._panes()
        base.query_one(TreePane).show(snapshot)
        base.query_one(MapPane).show(snapshot, self.source.info)
        base.query_one(VitalsPane).show(snapshot)
        speed, fit, error = base.query(Chart)
        speed.add(wanted=snapshot.commanded.linear, driven=snapshot.measured.linear)
        fit.add(fit=snapshot.quality)
        if snapshot.truth is not None:
            error.add(error=snapshot.pose.distance_to(snapshot.truth))
        base.set_class(snapshot.state is MissionState.EMERGENCY_STOP, "stopped")

    def _send(self, kind: str, **arguments: object) -> None:
        self.source.send(Command(uuid4().hex, kind, arguments))

    def action_estop(self) -> None:
        """Stop at once."""
        self._send("estop", reason="operator")

    def action_release(self) -> None:
        """Release the emergency stop."""
        self._send("release")

    def action_pause(self) -> None:
        """Pause or go on."""
        paused = self.snapshot is not None and self.snapshot.state is MissionState.PAUSED
        self._send("resume" if paused else "pause")

    def action_abort(self) -> None:
        """Ask, then end the mission."""
        answers = {"": "No, go on", "abort": "Yes, abort it: the robot stops, the report says so"}
        self.push_screen(Question("Abort the mission?", answers), self._abort_answered)

    def _abort_answered(self, answer: str | None) -> None:
        if answer == "abort":
            self._send("abort", reason="by the operator")

    def action_leave(self) -> None:
        """Leave; while the mission runs, ask whether to leave it running."""
        if self.snapshot is None or self.snapshot.state.is_over or self.source.report is not None:
            self.exit("over")
            return
        answers = {
            "leave": "Leave it running (treepilot watch comes back to it)",
            "abort": "Abort the mission",
            "": "Stay here",
        }
        self.push_screen(Question("The mission is still running.", answers), self._leave_answered)

    def _leave_answered(self, answer: str | None) -> None:
        if answer == "abort":
            self._send("abort", reason="by the operator")
        if answer:
            self.exit(answer)

    def action_help(self) -> None:
        """All keys."""
        self.push_screen(Help())

    def action_zoom(self, factor: float) -> None:
        """Map nearer or farther."""
        self.query_one(MapPane).zoom(factor)

    def action_fit(self) -> None:
        """The whole map."""
        self.query_one(MapPane).fit()

    def action_pan(self, right: int, up: int) -> None:
        """Move the map, or scroll the tree when it has the focus."""
        tree = self.query_one(TreePane)
        if tree.has_focus and up:
            tree.scroll_by(-up * 3)
        else:
            self.query_one(MapPane).pan(right, up)

    def action_costs(self) -> None:
        """Costmap on or off."""
        pane = self.query_one(MapPane)
        pane.costs_shown = not pane.costs_shown
        pane.fit() if pane.view is None else pane.zoom(1.0)

    def action_follow_tree(self) -> None:
        """Let the tree follow what runs."""
        self.query_one(TreePane).follow()

    def action_level(self) -> None:
        """Next level of the event log."""
        self.notify(f"events: {self.query_one(EventsPane).next_level()}", timeout=1.5)

    def action_zoom_pane(self) -> None:
        """The focused pane over the whole screen, and back."""
        name = self.focused.id if self.focused is not None else None
        if name in PANES:
            wanted = f"full-{name}"
            full = self.screen.has_class(wanted)
            for pane in PANES:
                self.screen.remove_class(f"full-{pane}")
            self.screen.set_class(not full, wanted)

    def key_1(self) -> None:
        """To the tree."""
        self.query_one(TreePane).focus()

    def key_2(self) -> None:
        """To the map."""
        self.query_one(MapPane).focus()

    def key_3(self) -> None:
        """To the vitals."""
        self.query_one(VitalsPane).focus()

    def key_4(self) -> None:
        """To the events."""
        self.query_one(EventsPane).focus()

    def action_speed(self, factor: float) -> None:
        """Simulate faster or slower."""
        self._speed_factor = min(64.0, max(0.25, self._speed_factor * factor))
        self._send("speed", factor=self._speed_factor)
        self.notify(f"speed {self._speed_factor:g}×", timeout=1.5)
