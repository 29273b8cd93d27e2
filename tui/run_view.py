"""View of one run, live or recorded: tree, map, vitals, charts, events. It uses telemetry only."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Footer

from stack.errors import TelemetryError
from stack.telemetry.records import Ack, MissionState, Snapshot
from tui.figures import Figures
from tui.keys import VIEW_KEYS, Key
from tui.link import STALE_AFTER, Link
from tui.pacing import Pacing
from tui.panes.banner import Banner, Notice
from tui.panes.banner import notice as current_notice
from tui.panes.charts import RunCharts
from tui.panes.events_pane import EventsPane
from tui.panes.map_pane import MapPane
from tui.panes.status_bar import StatusBar
from tui.panes.tree_pane import TreePane
from tui.panes.vitals_pane import VitalsPane
from tui.screens import AskText, Help
from tui.sheets.camera import CameraSheet
from tui.sheets.health import HealthSheet
from tui.sheets.plots import PlotSheet
from tui.sheets.sheet import Sheet, Shown
from tui.source import Source
from tui.terminal.app import TerminalApp

REFRESH = 0.1
"""Wall seconds between two refreshes."""

PANES = ("tree", "map", "vitals", "events", "charts")

WIDTHS = [(0, "-tiny"), (62, "-small"), (90, "-narrow"), (116, "-wide"), (160, "-huge")]
HEIGHTS = [(0, "-short"), (32, "-tall"), (46, "-high")]
"""Smallest terminal width (columns) and height (lines) of each class of the style sheet."""


class RunView(TerminalApp):
    """Shows a run, live or recorded; returns how it was left."""

    CSS_PATH = Path(__file__).with_name("app.tcss")
    TITLE = "treepilot"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = WIDTHS
    VERTICAL_BREAKPOINTS = HEIGHTS
    KEYS: ClassVar[tuple[Key, ...]] = VIEW_KEYS
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in VIEW_KEYS]
    IS_COMMANDED: ClassVar[bool] = False
    """Whether the run can be commanded."""

    def __init__(self, source: Source, *, live: bool = True) -> None:
        """Show a source.

        Args:
            source: the run; closed together with the dashboard.
            live: refresh by a timer. Tests disable it and call `refresh_now`.
        """
        super().__init__()
        self.source, self._live = source, live
        self.snapshot: Snapshot | None = None
        self._pacing = Pacing(everything=not live)
        self._figures = Figures()
        self._plotted = ["speed set m/s", "speed of the wheels m/s"]
        self.trouble = ""
        self._charts = RunCharts()

    def compose(self) -> ComposeResult:
        """Compose the panes from left to right, with the event log below."""
        yield StatusBar()
        yield Banner()
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield TreePane(debugs=self.IS_COMMANDED)
                yield VitalsPane()
            yield MapPane(commands=self.IS_COMMANDED)
            yield self._charts
        yield EventsPane()
        yield from self.below_panes()
        yield Footer(compact=True, show_command_palette=False)

    def below_panes(self) -> list[Widget]:
        """Widgets between the panes and the footer."""
        return []

    def on_mount(self) -> None:
        """Focus the map and start the refresh timer."""
        self.query_one(MapPane).focus()
        self.refresh_now()
        if self._live:
            self.set_interval(REFRESH, self.refresh_in_turn)

    def on_unmount(self) -> None:
        """Close the source; the run continues."""
        self.source.close()

    @property
    def is_over(self) -> bool:
        """Whether the run has ended."""
        snapshot, source = self.snapshot, self.source
        ended = source.is_over or source.report is not None
        return ended or (snapshot is not None and snapshot.state.is_over)

    def refresh_in_turn(self) -> None:
        """Refresh, less often while nothing happens; not while the panes are being taken down."""
        if not self.screen_stack or not self.panes.query(MapPane):
            return
        if self.terminal_is_gone:
            self.exit("hangup")
        elif self._pacing.begin_turn():
            self.catch_up()
            self.refresh_now()

    def refresh_now(self) -> None:
        """Receive new data and show it."""
        self._ensure_focus()
        fresh = self._receive()
        link = self.link()
        panes = self.panes
        is_news = fresh is not None and self._pacing.take(fresh)
        panes.query_one(Banner).show(self.notice(link))
        if fresh is None or self._pacing.draws_map:
            panes.query_one(StatusBar).show(self.snapshot, self.source.info, link)
        panes.set_class(not self.is_over and link.silent_for > STALE_AFTER, "stale")
        if fresh is not None and is_news:
            self.show(fresh)

    def notice(self, link: Link) -> Notice | None:
        """What the banner shows: the question about a placed pose comes first."""
        pane = self.panes.query_one(MapPane)
        if pane.draft is not None and not pane.dragging:
            return pane.draft.notice
        return current_notice(self.snapshot, link)

    @property
    def panes(self) -> Screen[object]:
        """The screen with the panes, below any dialog."""
        return self.screen_stack[0]

    def _receive(self) -> Snapshot | None:
        try:
            fresh, events, acks = self.source.poll(), self.source.events(), self.source.acks()
            past = self.past()
        except TelemetryError as error:
            self.trouble = str(error)
            return None
        self.snapshot = fresh or self.snapshot
        if past is not None:
            self._restart(past)
        self.take_acks(acks)
        if events:
            self.panes.query_one(EventsPane).add(events)
            self.panes.query_one(TreePane).take(events)
        if events or acks:
            self._pacing.hurry()
        return fresh

    def take_acks(self, acks: Sequence[Ack]) -> None:
        """Take the answers to commands."""

    def past(self) -> Sequence[Snapshot] | None:
        """Snapshots before the one that was just received, if what is shown is not its past."""
        return None

    def _restart(self, past: Sequence[Snapshot]) -> None:
        """Clear what was shown of other times; show the past in charts and as the driven way."""
        panes = self.panes
        panes.query_one(EventsPane).restart()
        panes.query_one(MapPane).restart(past)
        self._figures.restart()
        self._charts.restart()
        for snapshot in past:
            self._figures.add(snapshot)
            true_speed = self._figures.true_speed
            self._charts.add(snapshot, self.source.info, true_speed, draw=False)

    def link(self) -> Link:
        """State of the connection."""
        source = self.source
        return Link(
            source.silent_for, source.is_over or source.report is not None,
            source.report is not None, self.trouble,
        )  # fmt: skip

    def show(self, snapshot: Snapshot) -> None:
        """Show a new snapshot."""
        panes, pacing = self.panes, self._pacing
        self._figures.add(snapshot)
        true_speed = self._figures.true_speed
        if isinstance(self.screen, Sheet) and pacing.draws_map:
            self.screen.show(Shown(snapshot, self.link(), self._figures))
        draw = pacing.draws_figures
        if pacing.draws_map and panes.query_one(TreePane).show(snapshot):
            self.notify("the new tree starts from its root", title="reloaded", timeout=3.0)
        panes.query_one(MapPane).show(snapshot, self.source.info, draw=pacing.draws_map)
        if draw:
            panes.query_one(VitalsPane).show(snapshot, self.source.info, true_speed)
        self._charts.add(snapshot, self.source.info, true_speed, draw=draw)
        panes.set_class(snapshot.state is MissionState.EMERGENCY_STOP, "stopped")
        panes.set_class(snapshot.state is MissionState.PAUSED, "paused")

    def action_leave(self) -> None:
        """Leave."""
        self.exit("leave")

    def hurry(self) -> None:
        """Refresh at the full rate for a while."""
        self._pacing.hurry()

    def action_help(self) -> None:
        """Show all keys."""
        self.push_screen(Help(self.KEYS))

    def action_zoom(self, factor: float) -> None:
        """Zoom the map."""
        self.query_one(MapPane).zoom(factor)

    def action_fit(self) -> None:
        """Show the whole map."""
        self.query_one(MapPane).fit()

    def action_pan(self, right: int, up: int) -> None:
        """Move the map, or select a node of the tree."""
        tree = self.query_one(TreePane)
        if tree.has_focus and up:
            tree.choose(-up)
        else:
            self.query_one(MapPane).pan(right, up)

    def action_costs(self) -> None:
        """Show or hide the costmap."""
        self.query_one(MapPane).toggle_costs()

    def action_sheet(self, name: str) -> None:
        """Show health, plots or the camera over the panes."""
        make: dict[str, Callable[[], Sheet]] = {
            "health": HealthSheet, "plots": lambda: PlotSheet(self._plotted), "camera": CameraSheet,
        }  # fmt: skip
        sheet = make[name]()
        self.source.pictures = sheet.TAKES_PICTURES

        def closed(_: None) -> None:
            self.source.pictures = False

        self.push_screen(sheet, closed)
        self.call_after_refresh(self._fill_sheet, sheet)

    def _fill_sheet(self, sheet: Sheet) -> None:
        if self.snapshot is not None:
            sheet.show(Shown(self.snapshot, self.link(), self._figures))

    def action_search(self) -> None:
        """Ask for a text, and show the newest event with it."""

        def answered(text: str | None) -> None:
            pane = self.panes.query_one(EventsPane)
            if text and not pane.search(text):
                self.notify(f"no event has {text!r}", timeout=2.0)
            elif text:
                self.action_focus_pane("events")

        self.push_screen(AskText("Search the events", "part of a line"), answered)

    def action_follow_tree(self) -> None:
        """Let the tree follow the running node."""
        self.query_one(TreePane).follow()

    def action_level(self) -> None:
        """Switch to the next level of the event log."""
        self.query_one(EventsPane).next_filter()

    def action_focus_pane(self, name: str) -> None:
        """Focus a pane; show a hidden pane on the full screen."""
        pane = self.screen.query_one(f"#{name}")
        filled = any(self.screen.has_class(f"full-{other}") for other in PANES)
        hidden = any(not node.display for node in (pane, pane.parent) if node is not None)
        if filled or hidden:
            self._fill_with(name)
        pane.focus()

    def action_zoom_pane(self) -> None:
        """Show the focused pane on the full screen, or all panes again."""
        name = self.focused.id if self.focused is not None else None
        if name in PANES:
            self._fill_with("" if self.screen.has_class(f"full-{name}") else name)

    def action_all_panes(self) -> None:
        """Show all panes."""
        self._fill_with("")

    def _fill_with(self, name: str) -> None:
        for pane in PANES:
            self.screen.set_class(pane == name, f"full-{pane}")

    def _ensure_focus(self) -> None:
        """Focus the map when the focused pane is no longer visible."""
        screen = self.panes
        filled = any(screen.has_class(f"full-{pane}") for pane in PANES)
        if not filled and (screen.focused is None or not screen.focused.size):
            screen.set_focus(screen.query_one(MapPane))
