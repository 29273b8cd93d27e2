"""`follow_waypoints`: a `for_each` over poses that counts reached and missed waypoints."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.trees.context import Execution
from missions.trees.decorators import ForEach, Loop
from missions.trees.slots import Slot, Write
from stack.types import Failure


@dataclass(slots=True)
class Driven:
    """Sum of the distances of drives, metres."""

    metres: float = 0.0

    def add(self, metres: float) -> None:
        """Add a drive that has ended, has failed or was halted."""
        self.metres += metres


@dataclass(frozen=True, slots=True)
class WaypointSlots:
    """Variables and outputs of a `follow_waypoints`.

    Attributes:
        number: loop variable with the number of the waypoint, from 1.
        driven: receives the distance of each drive.
        outputs: writers of missed, reached and distance, if the mission uses them.
    """

    number: Slot
    driven: Driven
    outputs: Mapping[str, Write]


class FollowWaypoints(ForEach):
    """Drives to each waypoint and runs the task there; updates its outputs after each one."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, loop: Loop, slots: WaypointSlots
    ) -> None:
        super().__init__(name, child, execution, loop)
        self.slots = slots
        self.missed: dict[int, Failure] = {}
        self.reached = 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.missed, self.reached, self.slots.driven.metres = {}, 0, 0.0
            self._write()
        status = super().advance(fresh)
        if status is not Status.RUNNING:
            self._report()
        return status

    def _start_item(self) -> None:
        super()._start_item()
        self.slots.number.write(self.index + 1)
        where = self.execution.describe(self.items[self.index])
        missed = f"; {len(self.missed)} missed" if self.missed else ""
        self.feedback_message = f"{self.index + 1} of {len(self.items)}, {where}{missed}"

    def _item(self) -> str:
        return f"waypoint {self.index + 1} of {len(self.items)}"

    def _item_ended(self, failure: Failure | None) -> None:
        if failure is None:
            self.reached += 1
            self._emit("info", "waypoint", f"{self._item()} reached")
        else:
            self.missed[self.index + 1] = failure
            text = f"{self._item()} missed: {failure.code} {failure.sentence}"
            self._emit("warning", "waypoint_missed", text, code=str(failure.code))
        self._write()

    def _ignore_failure(self) -> None:
        """`_item_ended` has reported the failure."""

    def _write(self) -> None:
        metres = self.slots.driven.metres
        found = {"missed": list(self.missed), "reached": self.reached, "distance": metres}
        for name, write in self.slots.outputs.items():
            write(found[name])

    def _report(self) -> None:
        text = f"{self.reached} of {len(self.items)} reached"
        if self.missed:
            each = [f"{number} ({failure.code})" for number, failure in self.missed.items()]
            text += f", missed {', '.join(each)}"
        self.feedback_message = text
        level = "warning" if self.missed else "info"
        self._emit(
            level,
            "waypoints",
            f"{text}; {self.slots.driven.metres:.1f} m driven",
            missed=list(self.missed),
        )

    def _emit(self, level: str, kind: str, text: str, **fields: Any) -> None:
        node = self.execution.record(self).id
        self.execution.emit(level=level, kind=kind, text=text, fields={"node": node, **fields})
