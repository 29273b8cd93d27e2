"""`follow_waypoints`: a `for_each` over poses that keeps account of what was reached and missed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.scope import UNSET
from missions.trees.context import Execution
from missions.trees.decorators import ForEach, Loop
from missions.trees.slots import Slot, Write
from stack.types import Failure


@dataclass(frozen=True, slots=True)
class Account:
    """Where the account of a `follow_waypoints` goes.

    Attributes:
        number: the loop variable that counts, from 1.
        driven: what the drive under way wrote when it ended, metres.
        outputs: writers of missed, reached and distance, as far as the mission wants them.
    """

    number: Slot
    driven: Slot
    outputs: Mapping[str, Write]


class FollowWaypoints(ForEach):
    """Drives to each waypoint and does the task there; its outputs are current after each one."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, loop: Loop, account: Account
    ) -> None:
        super().__init__(name, child, execution, loop)
        self.account = account
        self.missed: dict[int, Failure] = {}
        self.reached, self.distance = 0, 0.0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.missed, self.reached, self.distance = {}, 0, 0.0
            self._write()
        status = super().advance(fresh)
        if status is not Status.RUNNING:
            self._conclude()
        return status

    def _take(self) -> None:
        super()._take()
        self.account.number.write(self.index + 1)
        self.account.driven.write(None)
        where = self.execution.describe(self.items[self.index])
        behind = f"; {len(self.missed)} missed" if self.missed else ""
        self.feedback_message = f"{self.index + 1} of {len(self.items)}, {where}{behind}"

    def _item(self) -> str:
        return f"waypoint {self.index + 1} of {len(self.items)}"

    def _ended(self, failure: Failure | None) -> None:
        driven = self.account.driven.value
        self.distance += 0.0 if driven is UNSET else driven
        if failure is None:
            self.reached += 1
            self._tell("info", "waypoint", f"{self._item()} reached")
        else:
            self.missed[self.index + 1] = failure
            text = f"{self._item()} missed: {failure.code} {failure.sentence}"
            self._tell("warning", "waypoint_missed", text, code=str(failure.code))
        self._write()

    def _pass_over(self) -> None:
        self.execution.deal_with(self.child)  # what there is to tell, `_ended` has told

    def _write(self) -> None:
        found = {
            "missed": list(self.missed), "reached": self.reached, "distance": self.distance,
        }  # fmt: skip
        for name, write in self.account.outputs.items():
            write(found[name])

    def _conclude(self) -> None:
        text = f"{self.reached} of {len(self.items)} reached"
        if self.missed:
            each = [f"{number} ({failure.code})" for number, failure in self.missed.items()]
            text += f", missed {', '.join(each)}"
        self.feedback_message = text
        level = "warning" if self.missed else "info"
        self._tell(
            level, "waypoints", f"{text}; {self.distance:.1f} m driven", missed=list(self.missed)
        )

    def _tell(self, level: str, kind: str, text: str, **fields: Any) -> None:
        node = self.execution.record(self).id
        self.execution.emit(level=level, kind=kind, text=text, fields={"node": node, **fields})
