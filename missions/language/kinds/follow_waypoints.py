"""`follow_waypoints`: a `for_each` over poses with a drive to each, which counts the missed ones.

    - follow_waypoints: {waypoints: $shelves, tolerance: 20 cm}
      on_failure: continue
      do: {wait: 2 s}
      out: {missed: $missed}

expands to `for_each: {waypoint: $shelves}` with
`sequence: [navigate_to_pose: $waypoint, wait: 2 s]`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Role, Symbol
from missions.language.expressions.value_types import INT, POSE, ValueType, type_of
from missions.language.kinds.for_each import ForEach, ForEachStep, Loop
from missions.language.kinds.kind import NodeKind, NodeReading, Outline, Shape, Written
from missions.language.kinds.leaf import LeafStep, targets_text
from missions.language.kinds.sequence import SequenceStep
from missions.language.reading.modifiers import keeps_going, value_in
from missions.language.reading.ports import Owner
from missions.language.step import Modifiers, Step, TreeBuilder
from missions.language.values import Constant, Reference, Value
from missions.trees.context import Execution
from missions.trees.node import Node
from missions.trees.slots import Frame, Slot, Write
from stack.documents import Finding
from stack.parameters import Declaration
from stack.types import Failure, Pose2D

DRIVE = "navigate_to_pose"
"""The behaviour that drives to a waypoint."""
_PORTS = (
    Declaration("waypoints", list[Pose2D], "poses to drive to in order, map frame"),
    Declaration(
        "tolerance", float | None, "goal tolerance; default: the robot's",
        unit="m", default=None, above=0.0,
    ),
    Declaration(
        "time_limit", float | None, "time limit of the drive to each waypoint; default: none",
        unit="s", default=None, above=0.0,
    ),
)  # fmt: skip
_OUTPUTS = (
    Declaration("missed", list[int], "numbers of the missed waypoints, from 1"),
    Declaration("reached", int, "number of waypoints where drive and `do` succeeded"),
    Declaration("distance", float, "distance driven to the waypoints", "m"),
)
PORTS, OUTPUTS = ({item.name: item for item in declared} for declared in (_PORTS, _OUTPUTS))
VARIABLES = {"waypoint": POSE, "waypoint_number": INT}


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


@dataclass(frozen=True, slots=True)
class FollowWaypointsStep(ForEachStep):
    """`follow_waypoints: $waypoints`: for each waypoint a drive, then the node under `do`.

    Attributes:
        number: variable with the number of the waypoint, from 1.
        driven: receives the distance of the drive, metres; missions cannot access it.
        outputs: targets of missed, reached and distance.
    """

    number: Symbol
    driven: Symbol
    outputs: Mapping[str, Symbol]

    def writes(self) -> tuple[Symbol, ...]:
        return tuple(self.outputs.values())

    def results(self) -> Mapping[str, Symbol]:
        return self.outputs

    def variables(self) -> tuple[Symbol, ...]:
        return ()

    @property
    def detail(self) -> str:
        return ", ".join([self.items.source, *targets_text(self.outputs)])

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        inside, slot = frame.with_slot(self.variable)
        inside, number = inside.with_slot(self.number)
        driven = Driven()
        inside = replace(inside, writers={**inside.writers, self.driven: driven.add})
        outputs = {name: frame.writers[symbol] for name, symbol in self.outputs.items()}
        slots = WaypointSlots(number, driven, outputs)
        child = builder.step(self.child, inside)
        loop = self.loop(frame, slot.write)
        return FollowWaypoints(self.name or self.kind, child, builder.execution, loop, slots)

    def problems(self) -> Iterator[Finding]:
        yield from ForEachStep.problems(self)
        poses = self.items.value if isinstance(self.items, Constant) else ()
        for number, (one, other) in enumerate(pairwise(poses), 2):
            if one == other and isinstance(self.items, Constant) and self.items.is_written:
                mark = self.items.items[number - 1] if self.items.items else self.mark
                sentence = f"waypoint {number} is the same as waypoint {number - 1}"
                yield Finding(mark, "W134", sentence, "remove one of them")


def _read(reader: NodeReading, written: Written, context: NameContext) -> Step | None:
    head, raw = written.head, written.raw
    drive = reader.catalogue.get(DRIVE)
    if drive is None:
        sentence = f"{head.kind} needs the behaviour {DRIVE}"
        reader.findings.add("E121", head.mark, sentence)
        return None
    owner = Owner(head.kind, head.mark)
    ports = reader.ports.of_behaviour(PORTS, written.body, owner, context)
    results = {name: type_of(item) for name, item in OUTPUTS.items()}
    outputs = reader.ports.outputs(results, value_in(raw, "out"), owner, context)
    symbols = {
        name: Symbol(name, Role.VARIABLE, kind, head.mark) for name, kind in VARIABLES.items()
    }
    for symbol in symbols.values():
        reader.warn_of_hiding(symbol, context)
    inside = replace(context, scope=context.scope.inside(symbols))
    task = reader.child(raw["do"], head, inside) if "do" in raw else None
    if "waypoints" not in ports or ("do" in raw and task is None):
        return None
    driven = Symbol("driven", Role.VARIABLE, ValueType(float, "m"), head.mark)
    given: dict[str, Value] = {"goal": Reference(symbols["waypoint"])}
    if "tolerance" in ports:
        given["tolerance"] = ports["tolerance"]
    child: Step = LeafStep(
        drive.name, head.mark, "", Modifiers(timeout=ports.get("time_limit")),
        drive, given, {"path_length": driven},
    )  # fmt: skip
    if task is not None:
        child = SequenceStep("sequence", head.mark, "", Modifiers(), (child, task))
    return FollowWaypointsStep(
        *head, symbols["waypoint"], ports["waypoints"], keeps_going(raw), child,
        symbols["waypoint_number"], driven, outputs,
    )  # fmt: skip


FOLLOW_WAYPOINTS = NodeKind(
    "follow_waypoints",
    "drives to poses in order and runs `do` (optional) at each; with "
    "`on_failure: continue` a failed waypoint counts as missed and the next one follows",
    Shape.LOOP, "⚑", Outline.HEXAGON, FollowWaypoints, "{follow_waypoints: [[1, 2]]}",
    keeps="the list, the current waypoint and the missed ones", empty="the list was empty",
    ports=PORTS, outputs=OUTPUTS, takes_outputs=True, read=_read, step=FollowWaypointsStep,
)  # fmt: skip
