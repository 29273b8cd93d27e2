"""The dashboard of a live run, with the keys that control it.

Closing it does not stop the mission unless the operator asks for that.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import ClassVar
from uuid import uuid4

from textual.binding import BindingType

from stack.errors import TelemetryError
from stack.telemetry.records import Ack, Command, MissionState, Snapshot
from stack.types import ParameterTable, Pose2D
from tui.disturbing import LIFT, Choice, choices
from tui.keys import KEYS
from tui.link import Link, StopConfirmation
from tui.panes.banner import Notice, demo_notice
from tui.panes.map_pane import MapPane
from tui.panes.tree_pane import TreePane
from tui.places import ON_MAP, PlaceScreen
from tui.run_view import RunView
from tui.screens import Question
from tui.source import Source
from tui.tuning import ParameterScreen

TELEOP_LINEAR, TELEOP_ANGULAR, TELEOP_LATERAL = 0.25, 0.6, 0.2
"""Velocities of the arrow keys in teleoperation: m/s, rad/s, m/s. One press acts for 0.5 s."""


class Dashboard(RunView, inherit_bindings=False):
    """Shows and commands a run until the operator leaves.

    Returns `over` (the run has ended), `leave` (it continues), `hangup` (the terminal is
    gone), `abort` (the operator aborted it), `interrupt` (ctrl+c), `terminated` (a signal ended
    the dashboard alone) or `lost` (the engine does not answer).
    """

    KEYS = KEYS
    BINDINGS: ClassVar[list[BindingType]] = [key.binding() for key in KEYS]
    IS_COMMANDED = True

    def __init__(
        self, source: Source, *, live: bool = True,
        terminated: Callable[[], bool] = lambda: False, owns_run: bool = False,
        is_demo: bool = False,
    ) -> None:  # fmt: skip
        """Show a source.

        Args:
            source: the run; closed together with the dashboard.
            live: refresh by a timer. Tests disable it and call `refresh_now`.
            terminated: called at each refresh; if it returns True, the dashboard returns
                `terminated`.
            owns_run: whether ctrl+c returns `interrupt`, because the run was started here.
                Otherwise ctrl+c acts like q.
            is_demo: whether the banner says all the time what the robot does, and what to press.
        """
        super().__init__(source, live=live)
        self._terminated, self._owns_run, self._is_demo = terminated, owns_run, is_demo
        self._speed_factor = 1.0
        self._stop = StopConfirmation()
        self._teleop_ids: deque[str] = deque(maxlen=50)
        self._answered: dict[str, Callable[[Ack], None]] = {}
        self._was_teleop = False

    def refresh_in_turn(self) -> None:
        """End after a signal; otherwise refresh."""
        if self._terminated():
            self.exit("terminated")
        else:
            super().refresh_in_turn()

    def refresh_now(self) -> None:
        """Receive new data and show it."""
        self._stop.refresh()
        super().refresh_now()

    def link(self) -> Link:
        """State of the connection, and of an emergency stop that was sent."""
        return replace(super().link(), stop_unconfirmed=self._stop.is_late)

    def notice(self, link: Link) -> Notice | None:
        """What the banner shows; in the demo, always something."""
        found = super().notice(link)
        if found is None and self._is_demo and self.snapshot is not None:
            return demo_notice(self.snapshot)
        return found

    def take_acks(self, acks: Sequence[Ack]) -> None:
        """Pass the answers on; show refusals."""
        for ack in acks:
            if self._stop.take(ack):
                self.notify("the engine has accepted it", title="emergency stop", timeout=2.0)
            answered = self._answered.pop(ack.id, None)
            if answered is not None:
                answered(ack)
            elif not ack.done and ack.id not in self._teleop_ids:
                self.notify(ack.reason, severity="warning", title="refused")

    def show(self, snapshot: Snapshot) -> None:
        """Show a new snapshot."""
        super().show(snapshot)
        if snapshot.teleop and not self._was_teleop:
            self.panes.query_one(MapPane).focus()  # in the event log the arrow keys would scroll
        self._was_teleop = snapshot.teleop
        if isinstance(self.screen, ParameterScreen):
            self.screen.show(snapshot.parameters)

    def action_pan(self, right: int, up: int) -> None:
        """Drive in teleoperation; otherwise move the map, or select a node of the tree."""
        if self._is_teleop:
            self._teleop(linear=TELEOP_LINEAR * up, angular=-TELEOP_ANGULAR * right)
        else:
            super().action_pan(right, up)

    def _send(self, kind: str, **arguments: object) -> str:
        """Send a command; return its id, or "" if it could not be sent."""
        command = Command(uuid4().hex, kind, arguments)
        try:
            self.source.send(command)
        except TelemetryError as error:
            self.notify(str(error), severity="error", title="not sent")
            return ""
        self.hurry()
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
        elif self.trouble or self.link().is_lost(self.snapshot):
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

    def on_tree_pane_command_request(self, request: TreePane.CommandRequest) -> None:
        """Send a debugging command of the tree pane."""
        self._send(request.kind, **request.arguments)

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
        """Send the robot somewhere."""
        self._ask_place("Send the robot to", "set_goal")

    def action_cancel_goal(self) -> None:
        """Cancel the drive to the operator's goal."""
        self._send("cancel_goal")

    def action_stands_at(self) -> None:
        """Set the robot's pose."""
        self._ask_place("The robot stands at", "set_pose")

    def _ask_place(self, question: str, kind: str) -> None:
        info = self.source.info

        def answered(pose: Pose2D | str | None) -> None:
            if isinstance(pose, Pose2D):
                self._send(kind, x=pose.x, y=pose.y, heading=pose.heading)
            elif pose == ON_MAP:
                self.query_one(MapPane).place(kind)
                self.refresh_now()

        self.push_screen(PlaceScreen(question, {} if info is None else info.places), answered)

    def on_map_pane_placed(self, placed: MapPane.Placed) -> None:
        """Send a pose that was placed on the map."""
        pose = placed.pose
        self._send(placed.kind, x=pose.x, y=pose.y, heading=pose.heading)

    def action_disturb(self, kind: str = "") -> None:
        """Do something to a simulated world; without a kind, ask what."""
        if kind:
            self._disturb(Choice("", kind))
        elif self.snapshot is not None:
            known = {str(n): choice for n, choice in enumerate(choices(self.snapshot))}
            answers = {"": "Nothing"} | {name: choice.text for name, choice in known.items()}

            def answered(name: str | None) -> None:
                if name:
                    self._disturb(known[name])

            self.push_screen(Question("What happens to the robot?", answers), answered)

    def _disturb(self, choice: Choice) -> None:
        if choice.kind == LIFT:
            self.query_one(MapPane).place(LIFT)
            self.refresh_now()
        else:
            self._send(choice.kind, **choice.arguments)

    def action_speed(self, factor: float) -> None:
        """Change the simulation speed."""
        wanted = min(64.0, max(0.25, self._speed_factor * factor))
        if self._send("speed", factor=wanted):
            self._speed_factor = wanted
            self.notify(f"simulating at up to {wanted:g}×", timeout=1.5)
