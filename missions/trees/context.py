"""What the nodes of one running tree share: the robot, failures and their paths, status changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.terms import shown
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
"""py_trees' statuses in the words of events and rows."""


@dataclass(frozen=True, slots=True)
class FailureTrace:
    """A failure and the labels of the nodes from the one that reports it down to the cause."""

    failure: Failure
    path: tuple[str, ...]


@dataclass(slots=True)
class Record:
    """One node as the screen and the event log know it.

    Attributes:
        label: what a failure's path calls it; "" leaves it out (decorators, unnamed composites).
        detail: its ports as written, for drawings.
        mark: where it stands in the mission file.
        shown: nothing has changed since its row was last made.
        names: what tests of missions may call it: its own name, its behaviour or tree, its event.
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
    shown: bool = True
    names: tuple[str, ...] = ()

    def as_row(self) -> TreeRow:
        """The node as it is now."""
        message = self.node.feedback_message
        if not message and self.status is Status.INVALID:
            message = self.detail
        return TreeRow(
            self.id, self.parent, self.node.name, self.kind, WORDS[self.status], message, self.since
        )


def _nobody(*_: Any, **__: Any) -> None:
    """Stands for a listener until `setup`."""


@dataclass(slots=True)
class Execution:
    """Shared by the nodes of one tree; a process may run many.

    Attributes:
        robot: from `setup` on.
        emit: takes level, kind, text and fields of an event.
        log: takes tracebacks; they are not part of the hashed event log.
        error: code of the last failure that a recover or a fallback dealt with.
        recoveries: how many recoveries have been run.
        standing_by: running children of reactive composites while an earlier child is looked at;
            they are halted before a behaviour that moves the robot starts.
        place_names: for showing poses by name.
        stale: records whose status has changed since their rows were last made.
        starts: told of every node that begins a run; None while nobody wants to know.
        visited: while py_trees' own tools tick: the nodes that have answered, and what.
    """

    robot: Robot = field(init=False)
    emit: Callable[..., None] = _nobody
    log: Callable[[str], None] = _nobody
    error: str = ""
    recoveries: int = 0
    left_out: float = 0.0
    standing_by: list[Behaviour] = field(default_factory=list)
    place_names: dict[Pose2D, str] = field(default_factory=dict)
    records: dict[int, Record] = field(default_factory=dict)
    stale: list[Record] = field(default_factory=list)
    trails: dict[int, FailureTrace] = field(default_factory=dict)
    starts: Callable[[Behaviour], None] | None = None
    visited: list[tuple[Behaviour, Status]] | None = None

    def record(self, node: Behaviour) -> Record:
        """The record of a node of this tree."""
        return self.records[id(node)]

    def fail(self, node: Behaviour, failure: Failure, name: str = "") -> Status:
        """FAILURE of a node for a reason of its own; `name` is what the path ends with."""
        node.feedback_message = failure.sentence
        # A cause always has a name, or the path would end in the air.
        self.trails[id(node)] = FailureTrace(
            failure, (name or self.record(node).label or node.name,)
        )
        return Status.FAILURE

    def pass_on(self, node: Behaviour, child: Behaviour, note: str = "") -> Status:
        """FAILURE of a node because a child failed; `note` goes behind its label in the path."""
        trail = self.trail(child)
        label = self.record(node).label or (node.name if note else "")
        here = (f"{label} ({note})" if note else label,) if label else ()
        self.trails[id(node)] = FailureTrace(trail.failure, here + trail.path)
        return Status.FAILURE

    def trail(self, node: Behaviour) -> FailureTrace:
        """Why a node failed."""
        unknown = Failure(FailureCode.FAILED, node.feedback_message or "failed")
        return self.trails.get(id(node)) or FailureTrace(unknown, (node.name,))

    def deal_with(self, child: Behaviour) -> None:
        """A failure that the mission goes on from: what `error` is from now on."""
        self.error = str(self.trail(child).failure.code)

    def pass_over(self, node: Behaviour, child: Behaviour, note: str = "") -> None:
        """Say that a failure was passed over because of `on_failure: continue`."""
        trail = self.trail(child)
        self.deal_with(child)
        path = " > ".join((*((note,) if note else ()), *trail.path))
        self.emit(
            level="warning", kind="failure_passed_over",
            text=f"{path}: {trail.failure.code} {trail.failure.sentence}",
            fields={"node": self.record(node).id, "code": str(trail.failure.code)},
        )  # fmt: skip

    def became(self, node: Behaviour, status: Status) -> None:
        """Emit a change of status; called in the order in which nodes answer or are halted."""
        record = self.records.get(id(node))
        if record is not None and record.status is not status:
            self.changed(record, status)

    def changed(self, record: Record, status: Status) -> None:
        """As `became`, of a node whose record is at hand and whose status is another."""
        previous, record.status = record.status, status
        record.since = self.robot.time
        if record.shown:
            record.shown = False
            self.stale.append(record)
        if self.emit is _nobody:
            return
        before, node = WORDS[previous], record.node
        self.emit(
            level="info", kind="node_status", text=f"{node.name}: {before} > {WORDS[status]}",
            fields={
                "node": record.id, "name": node.name, "from": before, "to": WORDS[status],
                "message": node.feedback_message if status is not Status.RUNNING else "",
            },
        )  # fmt: skip

    @property
    def time(self) -> float:
        """Robot time without pauses: what time limits, delays and holds run on."""
        return self.robot.time - self.left_out

    def free_the_wheels(self) -> None:
        """Halt what would be pre-empted anyway, before a behaviour that moves the robot starts."""
        while self.standing_by:
            halt(self.standing_by.pop())

    def describe(self, value: Any) -> str:
        """A value for people: a place by its name."""
        if isinstance(value, Pose2D) and value in self.place_names:
            return self.place_names[value]
        return shown(value)


def halt(node: Behaviour) -> None:
    """Bring a node and all below it to rest; a finished one forgets its outcome."""
    if node.status is not Status.INVALID:
        node.stop(Status.INVALID)
