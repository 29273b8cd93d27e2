"""Modes of the vehicle, with ArduRover's numbers, and how the mission gets into them."""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum

from stack.telemetry.mavlink.geography import Geography
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.orders import Done, Orders
from stack.telemetry.mavlink.plan_runner import PlanRunner
from stack.telemetry.mavlink.texts import Texts
from stack.telemetry.records import MissionState, Snapshot

RTL_TAG = "mavlink home"


class Mode(IntEnum):
    """Numbers of ArduRover."""

    MANUAL = 0
    HOLD = 4
    AUTO = 10
    RTL = 11
    GUIDED = 15
    INITIALISING = 16


SELECTABLE = (Mode.MANUAL, Mode.HOLD, Mode.AUTO, Mode.RTL, Mode.GUIDED)
TELEOPERATION = "assisted_teleop"
"""The behaviour of a mission that allows manual control."""

NO_MANUAL = "manual control is refused: the mission runs no assisted_teleop now"


def is_armed(snapshot: Snapshot | None) -> bool:
    """Whether the mission may move the robot."""
    return snapshot is not None and snapshot.state in (MissionState.RUNNING, MissionState.PAUSED)


class Modes:
    """The mode shown to stations, and the switches between modes.

    HOLD pauses. AUTO drives the uploaded plan, or continues the mission if there is none. GUIDED
    pauses and waits for a goal. RTL drives home. MANUAL drives by MANUAL_CONTROL while the mission
    runs `assisted_teleop`, else it pauses.

    Attributes:
        wanted: the last mode that a station has chosen; None before the first.
    """

    def __init__(
        self, handover: Handover, orders: Orders, plan: PlanRunner, geography: Geography,
        texts: Texts,
    ) -> None:  # fmt: skip
        self.wanted: Mode | None = None
        self._before_hold: Mode | None = None
        self._handover, self._orders, self._plan = handover, orders, plan
        self._geography, self._texts = geography, texts

    @property
    def shown(self) -> Mode:
        """The current mode."""
        snapshot, wanted = self._handover.snapshot, self.wanted
        if snapshot is None or snapshot.state is MissionState.STARTING:
            return Mode.INITIALISING
        if snapshot.state is MissionState.RUNNING:
            manual = wanted is Mode.MANUAL and snapshot.teleop
            return Mode.MANUAL if manual else Mode.AUTO
        if snapshot.state is not MissionState.PAUSED or snapshot.detour_held:
            return Mode.HOLD
        if wanted is None and self._plan.is_active:
            wanted = Mode.AUTO
        if wanted is Mode.AUTO and not self._plan.is_active:
            return Mode.HOLD  # at its end, or after it was cancelled
        if wanted in (Mode.AUTO, Mode.RTL, Mode.GUIDED, Mode.MANUAL):
            return wanted
        return Mode.GUIDED if snapshot.detour else Mode.HOLD

    def follow(self) -> None:
        """Forget the chosen mode once others have changed it: the mission runs, or was stopped."""
        snapshot = self._handover.snapshot
        if snapshot is None or snapshot.state is MissionState.PAUSED:
            return
        if snapshot.state is not MissionState.RUNNING or self.wanted is not Mode.MANUAL:
            self.wanted = None

    def switch(self, number: int, done: Done) -> None:
        """Change into a mode.

        Args:
            number: of ArduRover.
            done: called with an empty text, or with why it was refused.
        """
        snapshot = self._handover.snapshot
        if number not in SELECTABLE:
            choices = ", ".join(f"{mode.name} {mode.value}" for mode in SELECTABLE)
            done(f"there is no mode {number}; available: {choices}")
            return
        mode = Mode(number)
        if snapshot is None:
            done("the mission has not started")
            return
        if not is_armed(snapshot) and snapshot.state is not MissionState.STARTING:
            stopped = snapshot.state is MissionState.EMERGENCY_STOP
            why = "disarmed: the emergency stop is engaged" if stopped else "the mission is over"
            done("" if mode is Mode.HOLD else f"{mode.name} is refused: {why}")
            return
        enter: Callable[[Snapshot, Done], None] = {
            Mode.HOLD: self._hold, Mode.AUTO: self._auto, Mode.GUIDED: self._guide,
            Mode.RTL: self._return, Mode.MANUAL: self._manual,
        }[mode]  # fmt: skip

        def entered(refusal: str) -> None:
            if not refusal:
                self.wanted = mode
            done(refusal)

        enter(snapshot, entered)

    def resume(self, done: Done) -> None:
        """Continue what HOLD has paused: the plan, a drive of the operator, or the mission."""
        snapshot, before = self._handover.snapshot, self._before_hold
        if snapshot is None or self.shown is not Mode.HOLD:
            done("")
        elif self._plan.is_active:
            self.switch(Mode.AUTO, done)
        elif snapshot.detour_held:
            self.wanted = before
            self._orders.give("resume", done)
        else:
            self.wanted = None
            self.resume_mission(snapshot, done)

    def _hold(self, snapshot: Snapshot, done: Done) -> None:
        if self.wanted is not Mode.HOLD:
            self._before_hold = self.wanted
        self._plan.hold()
        self._orders.give("pause", done)

    def _auto(self, snapshot: Snapshot, done: Done) -> None:
        if self._plan.has_plan:
            self._plan.drive(done)
        else:
            self.resume_mission(snapshot, done)

    def leave_plan(self) -> None:
        """Stop driving the plan, because a station sends the robot elsewhere."""
        self._plan.suspend()

    def resume_mission(self, snapshot: Snapshot, done: Done) -> None:
        """Continue the mission itself; a drive of a station ends."""
        if snapshot.state is not MissionState.PAUSED:
            done("")
            return
        cancels = snapshot.detour or snapshot.detour_held
        self._orders.chain(["cancel_goal", "resume"] if cancels else ["resume"], done)

    def _guide(self, snapshot: Snapshot, done: Done) -> None:
        """Stand until a goal comes."""
        if self.shown is Mode.GUIDED:
            done("")
            return
        self._plan.suspend()
        cancels = snapshot.detour or snapshot.detour_held
        self._orders.give("cancel_goal" if cancels else "pause", done)

    def _return(self, snapshot: Snapshot, done: Done) -> None:
        home = self._geography.home
        if home is None:
            done("there is no home yet")
            return
        self._plan.suspend()
        self._orders.give(
            "set_goal", done, x=home.x, y=home.y, heading=home.heading, tag=RTL_TAG
        )  # fmt: skip

    def _manual(self, snapshot: Snapshot, done: Done) -> None:
        if any(row.kind == TELEOPERATION and row.status == "running" for row in snapshot.tree):
            self._plan.suspend()
            self.resume_mission(snapshot, done)
            return
        self._texts.tell(NO_MANUAL)
        self._plan.suspend()
        self._orders.give("pause", done)
