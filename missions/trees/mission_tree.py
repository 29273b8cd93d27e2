"""A compiled mission, which the runner sets up, ticks and halts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from py_trees.common import Status

from missions.language.expressions.scope import UNSET
from missions.language.expressions.value_types import ValueType
from missions.trees.context import WORDS, Execution, Record, halt
from missions.trees.events import Event
from missions.trees.leaves import LeafNode
from missions.trees.node import Node, run
from missions.trees.slots import Slot
from stack.documents import Finding
from stack.errors import InputError, exception_sentence
from stack.robot import Robot
from stack.telemetry.records import TreeRow
from stack.types import Failure


class MissionTree:
    """A tree of py_trees nodes with its blackboard.

    Attributes:
        root: the root node.
        execution: state shared by the nodes.
        ticks: number of ticks so far.
    """

    def __init__(
        self, name: str, root: Node, execution: Execution, slots: Mapping[str, Slot]
    ) -> None:
        self.name, self.root, self.ticks = name, root, 0
        self.execution, self._slots = execution, slots
        self._nodes: list[Node] = []
        self._records: list[Record] = []
        for number, (node, parent) in enumerate(_depth_first(root, None)):
            record = execution.record(node)
            record.id = number
            record.parent = -1 if parent is None else execution.record(parent).id
            self._nodes.append(node)
            self._records.append(record)
            node.record = record
        self._claiming = [
            (node, node.robot_leaf.claims) for node in self._nodes
            if isinstance(node, LeafNode) and node.robot_leaf is not None and node.robot_leaf.claims
        ]  # fmt: skip
        self._is_paused = False
        self._table = [record.as_row() for record in self._records]
        self._rows = tuple(self._table)

    def setup(
        self, robot: Robot, emit: Callable[..., None] | None = None,
        log: Callable[[str], None] | None = None,
    ) -> None:  # fmt: skip
        """Pass the robot to every node.

        Args:
            robot: the robot for behaviours and expressions.
            emit: called as emit(level=…, kind=…, text=…, fields=…) for node_status, recovery,
                failure_passed_over, event, event_done, exception and the events of waypoints;
                None ignores them.
            log: receives tracebacks, which are not part of the hashed event log.

        Raises:
            InputError: the setup of a behaviour raises an exception; nothing has moved.
        """
        execution = self.execution
        execution.robot = robot
        if emit is not None:
            execution.emit = emit
        if log is not None:
            execution.log = log
        findings = []
        for record in self._records:
            try:
                record.node.setup(robot=robot)
            except Exception as error:
                sentence = f"{record.kind}: setup failed: {exception_sentence(error)}"
                findings.append(Finding(record.mark, "E127", sentence))
            execution.mark_stale(record)
        if findings:
            raise InputError(findings)

    def tick(self) -> None:
        """Tick the tree once; does nothing after the end of the mission."""
        root = self.root
        if self.ticks and (root.status is _SUCCESS or root.status is _FAILURE):
            return
        self.ticks += 1
        self.execution.preemptible.clear()
        self.execution.items_left = ITEMS_PER_TICK
        run(root)
        self.execution.ticked[0] = _NO_NODE

    @property
    def status(self) -> Status:
        """RUNNING, SUCCESS or FAILURE; INVALID before the first tick and after a halt."""
        return self.root.status

    def pause(self, now: float) -> None:
        """Begin a pause at `now` on the robot's clock: time limits, delays and holds stand still.

        The tree is not ticked until `resume`. No effect while paused.
        """
        if not self._is_paused:
            self._is_paused = True
            for node in self._nodes:
                node.pause(now)

    def resume(self, now: float) -> None:
        """End a pause; no effect while not paused."""
        if self._is_paused:
            self._is_paused = False
            for node in self._nodes:
                node.resume(now)

    @property
    def outcome(self) -> str:
        """running | success | failure; idle before the first tick."""
        return WORDS[self.status]

    def halt(self) -> None:
        """Halt every node, the deepest first."""
        halt(self.root)

    @property
    def failure(self) -> Failure | None:
        """The first cause after a failure of the mission; None otherwise."""
        if self.status is not Status.FAILURE:
            return None
        return self.execution.trace(self.root).failure

    @property
    def reason(self) -> str:
        """Path from the root to the first cause, and its failure; empty without a failure."""
        if self.status is not Status.FAILURE:
            return ""
        trace = self.execution.trace(self.root)
        path = " > ".join((self.name, *trace.path))
        return f"{path}: {trace.failure.code} {trace.failure.sentence}"

    @property
    def recoveries(self) -> int:
        """Number of recoveries started."""
        return self.execution.recoveries

    @property
    def claims(self) -> list[tuple[str, ...]]:
        """What each behaviour that is running claims of the robot."""
        return [claims for node, claims in self._claiming if node.active]

    def blackboard(self) -> dict[str, str]:
        """Return every declared key with its value as text."""
        return {
            name: "not set" if slot.value is UNSET else self.execution.describe(slot.value)
            for name, slot in self._slots.items()
        }

    def values(self) -> dict[str, Any]:
        """Return every declared key with its value; UNSET if it has none."""
        return {name: slot.value for name, slot in self._slots.items()}

    def kept(self) -> dict[str, tuple[ValueType, Any]]:
        """Return type and value of the keys with `keep: true`; UNSET if it has none."""
        slots = self._slots.items()
        return {name: (slot.type, slot.value) for name, slot in slots if slot.keep}

    def write(self, key: str, value: Any) -> None:
        """Write a blackboard key."""
        self._slots[key].write(value)

    def force(self, event: str) -> None:
        """Let an event fire at the next tick, regardless of its `when`."""
        for record in self._records:
            if isinstance(record.node, Event) and record.node.name == event:
                record.node.trigger.forced = True

    def watch(self, starts: Callable[[Record], None]) -> None:
        """Call `starts` for every node that starts a run."""
        self.execution.starts = lambda node: starts(self.execution.record(node))

    def inherit(self, older: MissionTree) -> list[str]:
        """Continue the run of an older tree; return the values taken over, as `key = value`.

        A blackboard value is taken over if both trees declare its key with the same type.
        """
        self.ticks = older.ticks
        self.execution.ticked = older.execution.ticked
        self.execution.recoveries = older.execution.recoveries
        kept = []
        for name, slot in self._slots.items():
            former = older._slots.get(name)
            if former is not None and former.type == slot.type and former.value is not UNSET:
                slot.value = former.value
                kept.append(f"{name} = {self.execution.describe(slot.value)}")
        return kept

    @property
    def records(self) -> tuple[Record, ...]:
        """Records of all nodes, in drawing order."""
        return tuple(self._records)

    def rows(self) -> tuple[TreeRow, ...]:
        """Return a row per node in drawing order; the same tuple while nothing changes.

        Only rows of nodes whose status or message has changed are rebuilt; the nodes report these
        changes when they are ticked or halted.
        """
        stale = self.execution.stale
        if stale:
            for record in stale:
                self._table[record.id], record.shown = record.as_row(), True
                record.message = record.node.feedback_message
            stale.clear()
            self._rows = tuple(self._table)
        return self._rows


ITEMS_PER_TICK = 100
"""Items that the loops of a tree start in one tick; each loop starts at least one."""
_SUCCESS, _FAILURE = Status.SUCCESS, Status.FAILURE
_NO_NODE = -1


def _depth_first(node: Any, parent: Node | None) -> Iterator[tuple[Node, Node | None]]:
    yield node, parent
    for child in node.children:
        yield from _depth_first(child, node)
