"""A compiled mission: what the runner sets up, ticks, watches and halts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.scope import UNSET
from missions.trees.context import WORDS, Execution, Record, halt
from missions.trees.events import Event
from missions.trees.node import Node, run
from missions.trees.slots import Slot
from stack.documents import Finding
from stack.errors import InputError
from stack.robot import Robot
from stack.telemetry.records import TreeRow
from stack.types import Failure


class MissionTree:
    """A tree of py_trees nodes with its blackboard.

    Attributes:
        root: the py_trees node at the top.
        ticks: how often it has been ticked.
    """

    def __init__(
        self, name: str, root: Behaviour, execution: Execution, slots: Mapping[str, Slot]
    ) -> None:
        self.name, self.root, self.ticks = name, root, 0
        self._execution, self._slots = execution, slots
        self._records: list[Record] = []
        for number, (node, parent) in enumerate(_depth_first(root, None)):
            record = execution.record(node)
            record.id = number
            record.parent = -1 if parent is None else execution.record(parent).id
            self._records.append(record)
            if isinstance(node, Node):
                node.record = record
            else:
                node.update.__self__.record = record  # type: ignore[attr-defined] # its guard
        self._nodes = [record.node for record in self._records]
        self._messages = [node.feedback_message for node in self._nodes]
        self._table = [record.as_row() for record in self._records]
        self._rows = tuple(self._table)

    def setup(
        self, robot: Robot, emit: Callable[..., None] | None = None,
        log: Callable[[str], None] | None = None,
    ) -> None:  # fmt: skip
        """Hand the robot to every node.

        Args:
            robot: what behaviours and expressions see.
            emit: called as emit(level=…, kind=…, text=…, fields=…) for node_status, recovery,
                failure_passed_over, event, event_done and exception; None listens to nothing.
            log: takes tracebacks, which are not part of the hashed event log.

        Raises:
            InputError: a behaviour's setup raises; nothing has moved.
        """
        self._execution.robot = robot
        if emit is not None:
            self._execution.emit = emit
        if log is not None:
            self._execution.log = log
        findings = []
        for record in self._records:
            try:
                record.node.setup(robot=robot)
            except Exception as error:
                sentence = f"{record.kind}: setup failed: {type(error).__name__}: {error}"
                findings.append(Finding(record.mark, "E127", sentence))
        if findings:
            raise InputError(findings)

    def tick(self) -> None:
        """Let every node that has a turn take it. Does nothing once the mission is over."""
        root = self.root
        if self.ticks and (root.status is _SUCCESS or root.status is _FAILURE):
            return
        self.ticks += 1
        self._execution.standing_by.clear()
        run(root)

    @property
    def status(self) -> Status:
        """RUNNING, SUCCESS or FAILURE; INVALID before the first tick and after a halt."""
        return self.root.status

    def leave_out(self, seconds: float) -> None:
        """Time that passed while the mission was paused: no limit or delay counts it."""
        self._execution.left_out += seconds

    @property
    def outcome(self) -> str:
        """running | success | failure, for those who do not know py_trees."""
        return WORDS[self.status]

    def halt(self) -> None:
        """Bring every node to rest, the deepest first."""
        halt(self.root)

    @property
    def failure(self) -> Failure | None:
        """The first cause, once the mission has failed."""
        if self.status is not Status.FAILURE:
            return None
        return self._execution.trail(self.root).failure

    @property
    def reason(self) -> str:
        """The names from the root to the first cause, and what that says; empty before."""
        if self.status is not Status.FAILURE:
            return ""
        trail = self._execution.trail(self.root)
        path = " > ".join((self.name, *trail.path))
        return f"{path}: {trail.failure.code} {trail.failure.sentence}"

    @property
    def recoveries(self) -> int:
        """How many recoveries have been run."""
        return self._execution.recoveries

    def blackboard(self) -> dict[str, str]:
        """Every declared key with its value as text."""
        return {
            name: "not set" if slot.value is UNSET else self._execution.describe(slot.value)
            for name, slot in self._slots.items()
        }

    def values(self) -> dict[str, Any]:
        """Every declared key with its value; UNSET where there is none."""
        return {name: slot.value for name, slot in self._slots.items()}

    def write(self, key: str, value: Any) -> None:
        """Give a blackboard key a value."""
        self._slots[key].write(value)

    def force(self, event: str) -> None:
        """Let an event come with the next tick, whatever its `when`."""
        for record in self._records:
            if isinstance(record.node, Event) and record.node.name == event:
                record.node.trigger.forced = True

    def watch(self, starts: Callable[[Record], None]) -> None:
        """Be told of every node that begins a run."""
        self._execution.starts = lambda node: starts(self._execution.record(node))

    @property
    def execution(self) -> Execution:
        """What its nodes share."""
        return self._execution

    def inherit(self, older: MissionTree) -> list[str]:
        """Go on from a tree of the same run; what it hands over, as `key = value`.

        A blackboard value goes over where both declare its key with the same type.
        """
        self.ticks = older.ticks
        self._execution.recoveries = older._execution.recoveries
        kept = []
        for name, slot in self._slots.items():
            former = older._slots.get(name)
            if former is not None and former.type == slot.type and former.value is not UNSET:
                slot.value = former.value
                kept.append(f"{name} = {self._execution.describe(slot.value)}")
        return kept

    @property
    def records(self) -> tuple[Record, ...]:
        """What is known of every node, in drawing order."""
        return tuple(self._records)

    def rows(self) -> tuple[TreeRow, ...]:
        """Every node in drawing order; the same tuple as long as nothing has changed.

        Costs what has changed since it was last asked: statuses note their change themselves,
        messages are compared.
        """
        messages = [node.feedback_message for node in self._nodes]
        stale = self._execution.stale
        if messages != self._messages:
            pairs = zip(self._records, messages, self._messages, strict=True)
            stale.extend(record for record, new, old in pairs if new != old)
        if stale:
            for record in stale:
                self._table[record.id], record.shown = record.as_row(), True
            stale.clear()
            self._messages, self._rows = messages, tuple(self._table)
        return self._rows


_SUCCESS, _FAILURE = Status.SUCCESS, Status.FAILURE


def _depth_first(
    node: Behaviour, parent: Behaviour | None
) -> Iterator[tuple[Behaviour, Behaviour | None]]:
    yield node, parent
    for child in node.children:
        yield from _depth_first(child, node)
