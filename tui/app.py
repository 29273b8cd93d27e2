"""Dashboard of one run: tree, map, vitals, charts, events, and the keys that control the run.

It uses telemetry only. Closing it does not stop the mission unless the operator asks for that.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar
from uuid import uuid4

from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.widget import Widget
from textual.widgets import Footer

from stack.errors import TelemetryError
from stack.telemetry.records import Ack, Command, MissionState, Snapshot
from stack.types import ParameterTable
from tui.drawing import palette
from tui.keys import KEYS, Key
from tui.link import STALE_AFTER, Link, StopConfirmation
from tui.pacing import Pacing
from tui.panes.banner import Banner, notice
from tui.panes.chart import Chart
from tui.panes.events_pane import EventsPane
from tui.panes.map_pane import MapPane
from tui.panes.status_bar import StatusBar
from tui.panes.tree_pane import TreePane
from tui.panes.vitals_pane import VitalsPane
from tui.screens import Help, Question
from tui.source import Source
from tui.terminal.app import TerminalApp
from tui.tuning import ParameterScreen

REFRESH = 0.1
"""Wall seconds between two refreshes."""

PANES = ("tree", "map", "vitals", "events", "charts")

WIDTHS = [(0, "-tiny"), (62, "-small"), (90, "-narrow"), (116, "-wide"), (160, "-huge")]
HEIGHTS = [(0, "-short"), (32, "-tall"), (46, "-high")]
"""Smallest terminal width (columns) and height (lines) of each class of the style sheet."""

TELEOP_LINEAR, TELEOP_ANGULAR, TELEOP_LATERAL = 0.25, 0.6, 0.2
"""Velocities of the arrow keys in teleoperation: m/s, rad/s, m/s. One press acts for 0.5 s."""


class Charts(Vertical, can_focus=True):
    """The column of charts."""


class Dashboard(TerminalApp):
    """Shows a run until the operator leaves.

    Returns `over` (the run has ended), `leave` (it continues), `hangup` (the terminal is
    gone), `abort` (the operator aborted it), `interrupt` (ctrl+c), `terminated` (a signal ended
    the dashboard alone) or `lost` (the engine does not answer).
    """

    CSS_PATH = Path(__file__).with_name("app.tcss")
    TITLE = "treepilot"
    ENABLE_COMMAND_PALETTE = False
    HORIZONTAL_BREAKPOINTS = WIDTHS
    VERTICAL_BREAKPOINTS = HEIGHTS
    KEYS: ClassVar[tuple[Key, ...]] = KEYS
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in KEYS]
    DEBUGS: ClassVar[bool] = True
    """Whether the tree takes breakpoints and the like."""

    def __init__(
        self, source: Source, *, live: bool = True,
        terminated: Callable[[], bool] = lambda: False, owns_run: bool = False,
    ) -> None:  # fmt: skip
        """Show a source.

        Args:
            source: the run; closed together with the dashboard.
            live: refresh by a timer. Tests disable it and call `refresh_now`.
            terminated: called at each refresh; if it returns True, the dashboard returns
                `terminated`.
            owns_run: whether ctrl+c returns `interrupt`, because the run was started here.
                Otherwise ctrl+c acts like q.
        """
        super().__init__()
        self.source, self._live, self._terminated = source, live, terminated
        self._owns_run = owns_run
        self.snapshot: Snapshot | None = None
        self._pacing = Pacing(everything=not live)
        self._speed_factor = 1.0
        self._stop = StopConfirmation()
        self._teleop_ids: deque[str] = deque(maxlen=50)
        self._answered: dict[str, Callable[[Ack], None]] = {}
        self._was_teleop = False
        self._trouble = ""
        self._charts = (
            Chart("Speed", "m/s", {"set": palette.BUSY, "real": palette.PATH}, 0.0, 0.2),
            Chart("Localisation", "", {"health": palette.PARTICLE}, 0.0, 1.0),
            Chart("Pose error", "m", {"error": palette.PERSON}, 0.0, 0.05),
        )

    def compose(self) -> ComposeResult:
        """Compose the panes from left to right, with the event log below."""
        yield StatusBar()
        yield Banner()
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield TreePane(debugs=self.DEBUGS)
                yield VitalsPane()
            yield MapPane()
            with Charts(id="charts"):
                yield from self._charts
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
            self.set_interval(REFRESH, self._refresh_in_turn)

    def on_unmount(self) -> None:
        """Close the source; the run continues."""
        self.source.close()

    @property
    def is_over(self) -> bool:
        """Whether the run has ended."""
        snapshot, source = self.snapshot, self.source
        ended = source.is_over or source.report is not None
        return ended or (snapshot is not None and snapshot.state.is_over)

    def _refresh_in_turn(self) -> None:
        """Refresh, less often while nothing happens; not while the panes are being taken down."""
        if not self.screen_stack or not self._panes.query(MapPane):
            return
        if self._terminated():
            self.exit("terminated")
        elif self.terminal_is_gone:
            self.exit("hangup")
        elif self._pacing.begin_turn():
            self.catch_up()
            self.refresh_now()

    def refresh_now(self) -> None:
        """Receive new data and show it."""
        self._ensure_focus()
        fresh = self._receive()
        self._stop.refresh()
        link = self._link()
        panes = self._panes
        is_news = fresh is not None and self._pacing.take(fresh)
        panes.query_one(Banner).show(notice(self.snapshot, link))
        if fresh is None or self._pacing.draws_map:
            panes.query_one(StatusBar).show(self.snapshot, self.source.info, link)
        panes.set_class(not self.is_over and link.silent_for > STALE_AFTER, "stale")
        if fresh is not None and is_news:
            self._show(fresh)

    @property
    def _panes(self) -> Screen[object]:
        """The screen with the panes, below any dialog."""
        return self.screen_stack[0]

    def _receive(self) -> Snapshot | None:
        try:
            fresh, events, acks = self.source.poll(), self.source.events(), self.source.acks()
            past = self.past()
        except TelemetryError as error:
            self._trouble = str(error)
            return None
        self.snapshot = fresh or self.snapshot
        if past is not None:
            self._restart(past)
        for ack in acks:
            if self._stop.take(ack):
                self.notify("the engine has accepted it", title="emergency stop", timeout=2.0)
            answered = self._answered.pop(ack.id, None)
            if answered is not None:
                answered(ack)
            elif not ack.done and ack.id not in self._teleop_ids:
                self.notify(ack.reason, severity="warning", title="refused")
        if events:
            self._panes.query_one(EventsPane).add(events)
        if events or acks:
            self._pacing.hurry()
        return fresh

    def past(self) -> Sequence[Snapshot] | None:
        """Snapshots before the one that was just received, if what is shown is not its past."""
        return None

    def _restart(self, past: Sequence[Snapshot]) -> None:
        """Clear what was shown of other times; show the past in charts and as the driven way."""
        panes = self._panes
        panes.query_one(EventsPane).restart()
        panes.query_one(MapPane).restart(past)
        for chart in self._charts:
            chart.restart()
        for snapshot in past:
            self._chart(snapshot, draw=False)

    def _link(self) -> Link:
        source = self.source
        return Link(
            source.silent_for, source.is_over or source.report is not None,
            source.report is not None, self._trouble, self._stop.is_late,
        )  # fmt: skip

    def _show(self, snapshot: Snapshot) -> None:
        panes, pacing = self._panes, self._pacing
        draw = pacing.draws_figures
        if pacing.draws_map and panes.query_one(TreePane).show(snapshot):
            self.notify("the new tree starts from its root", title="reloaded", timeout=3.0)
        panes.query_one(MapPane).show(snapshot, self.source.info, draw=pacing.draws_map)
        if draw:
            panes.query_one(VitalsPane).show(snapshot)
        self._chart(snapshot, draw=draw)
        if snapshot.teleop and not self._was_teleop:
            panes.query_one(MapPane).focus()  # in the event log the arrow keys would scroll
        self._was_teleop = snapshot.teleop
        panes.set_class(snapshot.state is MissionState.EMERGENCY_STOP, "stopped")
        panes.set_class(snapshot.state is MissionState.PAUSED, "paused")
        if isinstance(self.screen, ParameterScreen):
            self.screen.show(snapshot.parameters)

    def _chart(self, snapshot: Snapshot, *, draw: bool) -> None:
        speed, health, error = self._charts
        now, set_, real = snapshot.time, snapshot.commanded.linear, snapshot.measured.linear
        speed.add(now, draw=draw, set=set_, real=real)
        health.add(now, draw=draw, health=snapshot.health)
        error.display = snapshot.truth is not None
        if snapshot.truth is not None:
            error.add(now, draw=draw, error=snapshot.pose.distance_to(snapshot.truth))

    def hurry(self) -> None:
        """Refresh at the full rate for a while."""
        self._pacing.hurry()

    def _send(self, kind: str, **arguments: object) -> str:
        """Send a command; return its id, or "" if it could not be sent."""
        command = Command(uuid4().hex, kind, arguments)
        try:
            self.source.send(command)
        except TelemetryError as error:
            self.notify(str(error), severity="error", title="not sent")
            return ""
        self._pacing.hurry()
        return command.id

    def action_estop(self) -> None:
        """Trigger the emergency stop."""
        self._stop.sent(self._send("estop", reason="operator"))

    def action_release(self) -> None:
        """Release the emergency stop."""
        self._send("release")

    def action_pause(self) -> None:
        """Pause or resume."""
        now = self.snapshot
        stands = now is not None and now.state is MissionState.PAUSED and not now.detour
        self._send("resume" if stands else "pause")

    def action_abort(self) -> None:
        """Abort the mission after a confirmation."""
        answers = {"": "No, continue", "abort": "Yes: stop the robot and end the mission"}
        self.push_screen(Question("Abort the mission?", answers), self._abort_answered)

    def _abort_answered(self, answer: str | None) -> None:
        if answer == "abort":
            self._send("abort", reason="operator")

    def action_interrupt(self) -> None:
        """End a run that this dashboard started; leave any other run."""
        if self._owns_run and not self.is_over:
            self.exit("interrupt")
        else:
            self.action_leave()

    def action_leave(self) -> None:
        """Leave; while the mission runs, ask first."""
        if self.is_over:
            self.exit("over")
        elif self._trouble or self._link().is_lost(self.snapshot):
            self.exit("lost")
        elif not isinstance(self.screen, Question):
            answers = {
                "": "Stay here",
                "leave": "Leave it running; `treepilot watch` attaches again",
                "abort": "Abort it and leave",
            }
            self.push_screen(Question("The mission is still running.", answers), self._left)

    def _left(self, answer: str | None) -> None:
        if answer == "leave" or (answer == "abort" and self._send("abort", reason="operator")):
            self.exit(answer)

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
        """Drive in teleoperation; otherwise move the map, or select a node of the tree."""
        if self._is_teleop:
            self._teleop(linear=TELEOP_LINEAR * up, angular=-TELEOP_ANGULAR * right)
            return
        tree = self.query_one(TreePane)
        if tree.has_focus and up:
            tree.choose(-up)
        else:
            self.query_one(MapPane).pan(right, up)

    @property
    def _is_teleop(self) -> bool:
        """Whether the mission has handed control to the operator."""
        return self.snapshot is not None and self.snapshot.teleop

    def _teleop(self, **velocity: float) -> None:
        """Send a velocity; the refusal of a late one is not shown."""
        self._teleop_ids.append(self._send("teleop", **velocity))

    def action_sideways(self, left: int) -> None:
        """Drive sideways in teleoperation."""
        if self._is_teleop:
            self._teleop(lateral=TELEOP_LATERAL * left)

    def action_teleop_done(self) -> None:
        """Return control to the mission."""
        if self._is_teleop:
            self._send("teleop_done")

    def action_costs(self) -> None:
        """Show or hide the costmap."""
        self.query_one(MapPane).toggle_costs()

    def on_tree_pane_command_request(self, request: TreePane.CommandRequest) -> None:
        """Send a debugging command of the tree pane."""
        self._send(request.kind, **request.arguments)

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
        screen = self._panes
        filled = any(screen.has_class(f"full-{pane}") for pane in PANES)
        if not filled and (screen.focused is None or not screen.focused.size):
            screen.set_focus(screen.query_one(MapPane))

    def action_tune(self) -> None:
        """List the parameters, to change some."""
        snapshot, info = self.snapshot, self.source.info
        layer = None if snapshot is None else snapshot.layers.get("parameters")
        table = None if layer is None else layer.content
        if snapshot is None or not isinstance(table, ParameterTable):
            self.notify("no parameters received yet", timeout=2.0)
            return
        file = Path(f"parameters-{info.run_id if info is not None else 'run'}.yaml")
        self.push_screen(
            ParameterScreen(table.parameters, snapshot.parameters, self._set_parameter, file)
        )

    def _set_parameter(self, name: str, value: object, answered: Callable[[Ack], None]) -> None:
        sent = self._send("set_parameter", name=name, value=value)
        self._answered[sent] = answered

    def action_goal(self) -> None:
        """Send the robot to a place."""
        self._ask_place("Send the robot to", "set_goal")

    def action_cancel_goal(self) -> None:
        """Cancel the drive to the operator's goal."""
        self._send("cancel_goal")

    def action_stands_at(self) -> None:
        """Set the robot's pose to a place."""
        self._ask_place("Set the robot's pose to", "set_pose")

    def _ask_place(self, question: str, kind: str) -> None:
        info = self.source.info
        places = info.places if info is not None else {}
        if not places:
            self.notify("this run has no named places", timeout=2.0)
            return

        def answered(name: str | None) -> None:
            if name:
                pose = places[name]
                self._send(kind, x=pose.x, y=pose.y, heading=pose.heading)

        answers = {"": "Cancel"} | {
            name: f"{name}  ({pose.x:.2f}, {pose.y:.2f})" for name, pose in places.items()
        }
        self.push_screen(Question(question, answers), answered)

    def action_speed(self, factor: float) -> None:
        """Change the simulation speed."""
        wanted = min(64.0, max(0.25, self._speed_factor * factor))
        if self._send("speed", factor=wanted):
            self._speed_factor = wanted
            self.notify(f"simulating at up to {wanted:g}×", timeout=1.5)
