"""Drives a plan: each item becomes behaviours that the engine carries out as detours."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink.geography import Geography
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.orders import Done, Orders, ignore
from stack.telemetry.mavlink.plan import (
    RETURN,
    SPEED,
    Item,
    Plan,
    PlanCheck,
)  # fmt: skip
from stack.telemetry.mavlink.texts import WARNING, Send, Texts
from stack.telemetry.records import Event
from stack.types import Pose2D

CRUISE_SPEED = "controller.cruise_speed"
CURRENT_PERIOD = 1.0
"""Wall seconds between two MISSION_CURRENT without a change."""


@dataclass(frozen=True, slots=True)
class _Step:
    """A part of an item: a behaviour of the engine."""

    name: str
    ports: tuple[str, ...]


class PlanRunner:
    """The uploaded plan and how far it is driven.

    Attributes:
        items: of the plan, in order; the first is home if `has_home`.
        current: index of the item that is driven, or is next.
        is_active: whether the plan is driven, or paused on the way.
    """

    def __init__(  # noqa: PLR0913
        self, handover: Handover, orders: Orders, check: PlanCheck, geography: Geography,
        send: Send, texts: Texts,
    ) -> None:  # fmt: skip
        self.items: Plan = ()
        self.current, self.is_active, self.has_home = 0, False, False
        self._handover, self._orders, self._check = handover, orders, check
        self._geography, self._send, self._texts = geography, send, texts
        self._is_complete, self._is_held, self._waits = False, False, False
        self._steps: list[_Step] = []
        self._tag, self._count = "", 0
        self._told = -CURRENT_PERIOD

    @property
    def first(self) -> int:
        """Index of the first item that is driven."""
        return 1 if self.has_home else 0

    @property
    def has_plan(self) -> bool:
        """Whether there is anything to drive."""
        return len(self.items) > self.first

    @property
    def state(self) -> int:
        """MISSION_STATE for stations."""
        if not self.has_plan:
            return int(mav.MISSION_STATE_NO_MISSION)
        if self._is_complete:
            return int(mav.MISSION_STATE_COMPLETE)
        if self.is_active:
            held = self._handover.snapshot is not None and self._handover.snapshot.detour_held
            return int(mav.MISSION_STATE_PAUSED if held else mav.MISSION_STATE_ACTIVE)
        started = self.current > self.first
        return int(mav.MISSION_STATE_PAUSED if started else mav.MISSION_STATE_NOT_STARTED)

    def replace(self, items: Plan, *, has_home: bool) -> None:
        """Take a new plan; an empty one clears it. Not while `is_active`."""
        self.items, self.has_home = tuple(items), has_home and bool(items)
        self.current, self._is_complete, self._steps = self.first, False, []
        self.tell_current()

    def set_current(self, index: int) -> str:
        """Choose the next item; drive to it at once if the plan is driven. Return a refusal."""
        if not 0 <= index < len(self.items):
            return f"there is no item {index}; the plan has {len(self.items)}"
        self.current, self._is_complete, self._steps = max(index, self.first), False, []
        if self.is_active:
            self._begin(ignore)
        self.tell_current()
        return ""

    def drive(self, done: Done) -> None:
        """Drive the plan from the current item on; a complete one from its first."""
        snapshot, waits = self._handover.snapshot, self._waits
        self._is_held = self._waits = False
        if self.is_active and waits:
            self._next_step(done)
        elif self.is_active and snapshot is not None and snapshot.detour_held:
            self._orders.give("resume", done)
        elif self.is_active:
            done("")
        else:
            if self._is_complete:
                self.current, self._is_complete = self.first, False
            self._begin(done)

    def hold(self) -> None:
        """Begin nothing until `drive`; the engine pauses what it drives now."""
        self._is_held = True

    def suspend(self) -> None:
        """Stop driving the plan: a station wants something else. `drive` begins the item again."""
        self._tag, self.is_active = "", False
        self._is_held = self._waits = False

    def take_event(self, event: Event) -> None:
        """Follow the end of a detour."""
        if event.kind != "detour" or not self._tag or event.fields.get("tag") != self._tag:
            return
        self._tag = ""
        status = event.fields.get("status")
        if status == "success":
            self._next_step(ignore)
            return
        self.is_active = False
        if status == "failure":  # the event itself is a warning, which says why
            self._texts.tell(f"the plan stops at item {self.current}", WARNING)
        self.tell_current()

    def tick(self, now: float) -> None:
        """Send MISSION_CURRENT once a second, wall seconds."""
        if now - self._told >= CURRENT_PERIOD:
            self._told = now
            self.tell_current()

    def tell_current(self) -> None:
        """Send MISSION_CURRENT."""
        self._send(mav.MAVLink_mission_current_message(
            self.current, len(self.items) or 65535, self.state, 1 if self.is_active else 2
        ))  # fmt: skip

    def _begin(self, done: Done) -> None:
        """Begin the current item."""
        item = self.items[self.current]
        self._steps = self._steps_of(item)
        self.is_active = True

        def begun(refusal: str) -> None:
            if refusal:
                self.is_active = False
                self._tag = ""
            done(refusal)

        if item.command == SPEED:
            self._set_speed(item, begun)
        else:
            self._next_step(begun)
        self.tell_current()

    def _next_step(self, done: Done) -> None:
        if self._is_held:
            self._waits = True
            done("")
            return
        if not self._steps:
            self._reached(done)
            return
        step = self._steps.pop(0)
        self._count += 1
        tag = self._tag = f"mavlink item {self.current} ({self._count})"

        def begun(refusal: str) -> None:
            if refusal and self._tag == tag:
                self._tag, self.is_active = "", False
                if done is ignore:
                    text = f"the plan stops at item {self.current}: {refusal}"
                    self._texts.tell(text, WARNING)
            done(refusal)

        self._orders.give("behaviour", begun, name=step.name, ports=list(step.ports), tag=tag)

    def _reached(self, done: Done) -> None:
        """Report the current item as reached, and begin the next one."""
        self._send(mav.MAVLink_mission_item_reached_message(self.current))
        if self.current + 1 < len(self.items):
            self.current += 1
            self._orders.later(lambda: self._begin(done) if self.is_active else done("suspended"))
            return
        self.is_active, self._is_complete = False, True
        self._texts.tell("Mission complete")
        self.tell_current()
        done("")

    def _set_speed(self, item: Item, done: Done) -> None:
        """Change the cruise speed; the plan continues at the old one if it is refused."""

        def changed(refusal: str) -> None:
            if refusal:
                self._texts.tell(f"item {item.seq}: {refusal}", WARNING)
            self._reached(done)

        speed = item.parameters[1]
        if isfinite(speed) and speed > 0.0:
            self._orders.give("set_parameter", changed, name=CRUISE_SPEED, value=float(speed))
        else:
            changed("")

    def _steps_of(self, item: Item) -> list[_Step]:
        if item.command == SPEED:
            return []
        home = self._geography.home
        if item.command == RETURN:
            return [] if home is None else [_drive_to(home, None)]
        steps = []
        place = self._check.place_of(item)
        if place is not None:
            snapshot = self._handover.snapshot
            here = Pose2D(*place) if snapshot is None else snapshot.pose
            heading = here.bearing_to(Pose2D(*place))  # as it arrives
            steps.append(_drive_to(Pose2D(*place, heading), item.radius))
        if item.wait > 0.0:
            steps.append(_Step("wait", (f"time={item.wait:g}",)))
        return steps


def _drive_to(goal: Pose2D, tolerance: float | None) -> _Step:
    ports = [f"goal=[{goal.x:.3f}, {goal.y:.3f}, {goal.heading:.4f}]"]
    if tolerance is not None:
        ports.append(f"tolerance={tolerance:.3f}")
    return _Step("navigate_to_pose", tuple(ports))
