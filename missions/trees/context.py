"""State shared by the nodes of a running tree: robot, failures, records of the nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.shown import shown
from stack.documents import Mark
from stack.robot import Robot
from stack.telemetry.records import TreeRow
from stack.types import Failure, FailureCode, Pose2D

WORDS = {
    Status.RUNNING: "running",
    Status.SUCCESS: "success",
    Status.FAILURE: "failure",
    Status.INVALID: "idle",
}
"""py_trees status -> word in events and rows."""


@dataclass(frozen=True, slots=True)
class FailureTrace:
    """A failure, the labels of the nodes from the reporting node down to the cause, and its id."""

    failure: Failure
    path: tuple[str, ...]
    origin: int


class Gate(Protocol):
    """Decides before each tick of a node whether it is ticked; the debugger has one."""

    def outcome(self) -> Status | None:
        """Return the status of the node without ticking it, or None to tick it."""
        ...


@dataclass(slots=True)
class Record:
    """Data of one node for the dashboard, the event log and the debugger.

    Attributes:
        label: name in the path of a failure; "" omits it (decorators, unnamed composites).
        detail: its ports as written, for drawings.
        mark: position in the mission file.
        since: time of the last change of `status`, robot's clock, seconds.
        message: message of the node when its row was built.
        shown: its row is up to date.
        glyph: character of its kind in the dashboard.
        names: names for mission tests: its own, its behaviour or tree, its event.
        gate: asked before each tick of the node; None: always tick it.
    """

    node: Behaviour
    kind: str
    label: str
    detail: str
    mark: Mark
    id: int = -1
    parent: int = -1
    status: Status = Status.INVALID
    since: float = 0.0
    message: str = ""
    shown: bool = True
    names: tuple[str, ...] = ()
    gate: Gate | None = None
    glyph: str = ""

    def as_row(self) -> TreeRow:
        """Return the row with the current state of the node."""
        message = self.node.feedback_message
        if not message and self.status is Status.INVALID:
            message = self.detail
        return TreeRow(
            self.id,
            self.parent,
            self.node.name,
            self.kind,
            WORDS[self.status],
            message,
            self.since,
            self.glyph,
        )


class HandledFailure:
    """The failure that a `recover` or a fallback deals with; `error` reads its code.

    Attributes:
        code: its code; "" while it deals with none.
        outer: of the node around it, which `error` means meanwhile.
    """

    __slots__ = ("code", "outer")

    def __init__(self, outer: HandledFailure | None = None) -> None:
        self.code, self.outer = "", outer

    def read(self) -> str:
        """Return the code of the innermost failure that is dealt with; "" without one."""
        return self.code or (self.outer.read() if self.outer else "")


def _ignore(*_: Any, **__: Any) -> None:
    """Ignore events until `setup`."""


@dataclass(slots=True)
class Execution:
    """State shared by the nodes of one tree; a process can run several trees.

    Attributes:
        robot: available after `setup`.
        emit: receives level, kind, text and fields of an event.
        log: receives tracebacks, which are not part of the hashed event log.
        recoveries: number of recoveries started.
        preemptible: running children of reactive composites while an earlier child is ticked; they
            are halted before a behaviour that moves the robot starts.
        place_names: pose -> name of the place, to show poses by name.
        stale: records whose rows are not up to date.
        traces: id of a node -> its last failure.
        items_left: items that loops may still start in this tick.
        starts: called for every node that starts a run; None if not needed.
        visited: nodes ticked and their status, while py_trees' own tools tick the tree.
        ticked: one cell with the number of the node that is being ticked, -1 between two ticks. A
            supervising process may read it to tell which node does not return.
    """

    robot: Robot = field(init=False)
    emit: Callable[..., None] = _ignore
    log: Callable[[str], None] = _ignore
    recoveries: int = 0
    preemptible: list[Behaviour] = field(default_factory=list)
    place_names: dict[Pose2D, str] = field(default_factory=dict)
    records: dict[int, Record] = field(default_factory=dict)
    stale: list[Record] = field(default_factory=list)
    traces: dict[int, FailureTrace] = field(default_factory=dict)
    items_left: int = 0
    starts: Callable[[Behaviour], None] | None = None
    visited: list[tuple[Behaviour, Status]] | None = None
    ticked: memoryview[int] | list[int] = field(default_factory=lambda: [-1])

    def record(self, node: Behaviour) -> Record:
        """Return the record of a node of this tree."""
        return self.records[id(node)]

    def fail(self, node: Behaviour, failure: Failure, name: str = "") -> Status:
        """Return FAILURE of a node that is the cause; `name` is the last name of the path."""
        node.feedback_message = failure.sentence
        # The cause always has a name: it is the end of the path.
        self.traces[id(node)] = FailureTrace(
            failure, (name or self.record(node).label or node.name,), self.record(node).id
        )
        return Status.FAILURE

    def propagate_failure(self, node: Behaviour, child: Behaviour, note: str = "") -> Status:
        """Return FAILURE of a node whose child failed; `note` follows its label in the path."""
        trace = self.trace(child)
        label = self.record(node).label or (node.name if note else "")
        here = (f"{label} ({note})" if note else label,) if label else ()
        self.traces[id(node)] = FailureTrace(trace.failure, here + trace.path, trace.origin)
        return Status.FAILURE

    def trace(self, node: Behaviour) -> FailureTrace:
        """Return the failure of a node, with its path."""
        unknown = Failure(FailureCode.FAILED, node.feedback_message or "failed")
        found = self.traces.get(id(node))
        return found or FailureTrace(unknown, (node.name,), self.record(node).id)

    def code_of(self, node: Behaviour) -> str:
        """Return the code of a node's last failure."""
        return str(self.trace(node).failure.code)

    def ignore_failure(self, node: Behaviour, child: Behaviour, note: str = "") -> None:
        """Report a failure that is ignored because of `on_failure: continue`."""
        trace = self.trace(child)
        path = " > ".join((*((note,) if note else ()), *trace.path))
        self.emit(
            level="warning", kind="failure_passed_over",
            text=f"{path}: {trace.failure.code} {trace.failure.sentence}",
            fields={"node": self.record(node).id, "code": str(trace.failure.code)},
        )  # fmt: skip

    def set_status(self, node: Behaviour, status: Status) -> None:
        """Set a node's recorded status; called in the order in which nodes are ticked or halted."""
        record = self.records.get(id(node))
        if record is not None and record.status is not status:
            self.change_status(record, status)

    def update_record(self, record: Record, status: Status) -> None:
        """Record the status and the message of a node after its tick; one of them has changed."""
        if record.status is not status:
            self.change_status(record, status)
        else:
            self.mark_stale(record)

    def change_status(self, record: Record, status: Status) -> None:
        """Record and emit a change of status; `status` must differ from the recorded one."""
        previous, record.status = record.status, status
        record.since = self.robot.time
        self.mark_stale(record)
        if self.emit is _ignore:
            return
        before, node = WORDS[previous], record.node
        why = {}
        if status is Status.FAILURE:
            trace = self.trace(node)
            why = {"code": str(trace.failure.code), "origin": trace.origin}
        self.emit(
            level="info", kind="node_status", text=f"{node.name}: {before} > {WORDS[status]}",
            fields={
                "node": record.id, "name": node.name, "from": before, "to": WORDS[status],
                "message": node.feedback_message if status is not Status.RUNNING else "", **why,
            },
        )  # fmt: skip

    def mark_stale(self, record: Record) -> None:
        """Let the next `rows` of the tree build this row again."""
        if record.shown:
            record.shown = False
            self.stale.append(record)

    @property
    def time(self) -> float:
        """Seconds on the robot's clock."""
        return self.robot.time

    def halt_preemptible(self) -> None:
        """Halt pre-emptible nodes before a behaviour that moves the robot starts."""
        while self.preemptible:
            halt(self.preemptible.pop())

    def describe(self, value: Any) -> str:
        """Format a value for people; a place is shown by its name."""
        if isinstance(value, Pose2D) and value in self.place_names:
            return self.place_names[value]
        return shown(value)


def halt(node: Behaviour) -> None:
    """Halt a node and its descendants; the status of a finished node is reset."""
    if node.status is not Status.INVALID:
        node.stop(Status.INVALID)
