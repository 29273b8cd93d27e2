"""Base classes of nodes. They tick by direct calls.

py_trees ticks with nested generators, and every visited node passes through all nodes above it.
Here a node calls `execute_tick` of its child, which returns the status. `tick`, the generator for
py_trees' own tools, is built on it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, Self

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator as PyTreesDecorator

from behaviours.timer import Timer
from missions.trees.context import Execution, Record, halt
from missions.trees.latch import Latch, Read
from stack.errors import EvaluationError, ParameterError
from stack.types import Failure, FailureCode

_RUNNING, _INVALID = Status.RUNNING, Status.INVALID
VALUE_ERRORS = (EvaluationError, ParameterError)
"""Errors of values: a missing or invalid value, an expression that cannot be computed."""


def run(node: Behaviour) -> Status:
    """Tick a node of a compiled tree and return its status."""
    return node.execute_tick()  # type: ignore[attr-defined, no-any-return] # every one is a Node


class Node(Behaviour):
    """A node of a compiled tree. The tree sets `record`.

    A held mission is not ticked: `pause` and `resume` are called on all nodes, with the time on the
    robot's clock.
    """

    execution: Execution
    record: Record
    skipped: bool = False
    """Its last run was skipped; its status is then SUCCESS."""
    latches: tuple[Latch, ...] = ()
    """Values that it takes when it starts."""

    def taking(self, *reads: Read) -> Self:
        """Let the node take these values when it starts; those without a latch are read at once."""
        self.latches = tuple(read for read in reads if isinstance(read, Latch))
        return self

    @property
    def was_skipped(self) -> bool:
        """Whether it has ended and was skipped."""
        return self.skipped and self.status is Status.SUCCESS

    def execute_tick(self) -> Status:
        """Tick the node and return its status."""
        raise NotImplementedError

    def tick(self) -> Iterator[Behaviour]:
        """Tick the node and yield the ticked nodes, as py_trees does."""
        visited: list[tuple[Behaviour, Status]] = []
        self.execution.visited = visited
        self.execute_tick()
        self.execution.visited = None
        yield from (node for node, _ in visited)

    def update(self) -> Status:
        """Return the status; `execute_tick` does the work."""
        return self.status

    def timers(self) -> Iterable[Timer]:
        """Return the timers that stand still during a pause."""
        return ()

    def pause(self, now: float) -> None:
        """Begin a pause of the mission."""
        for timer in self.timers():
            timer.pause(now)

    def resume(self, now: float) -> None:
        """End a pause of the mission."""
        for timer in self.timers():
            timer.resume(now)

    def postpone(self, seconds: float) -> None:
        """Leave out an interruption of this node by an event."""
        for timer in self.timers():
            timer.shift(seconds)


class InnerNode(Node):
    """A node with children: subclasses define one tick in `advance`."""

    def advance(self, fresh: bool) -> Status:
        """Run one tick; `fresh` if the node was not running before."""
        raise NotImplementedError

    def execute_tick(self) -> Status:  # noqa: C901 - calls would slow every tick
        """Tick the node; a missing or invalid value becomes its failure."""
        record, execution = self.record, self.execution
        if record.gate is not None and (outcome := record.gate.outcome()) is not None:
            return outcome
        execution.ticked[0] = record.id
        fresh = self.status is not _RUNNING
        if fresh:
            self.feedback_message = ""
            self.skipped = False
            if execution.starts is not None:
                execution.starts(self)
        try:
            if fresh:
                for latch in self.latches:
                    latch.take()
            status = self.advance(fresh)
        except VALUE_ERRORS as error:
            status = self._fail(error)
        if status is not _RUNNING:
            self.stop(status)
        elif fresh:
            self.status = status
        if record.status is not status or self.feedback_message != record.message:
            execution.update_record(record, status)
        if execution.visited is not None:
            execution.visited.append((self, status))
        return status

    def skip(self, why: str = "skipped") -> Status:
        """Mark this run as skipped; return SUCCESS."""
        self.skipped, self.feedback_message = True, why
        return Status.SUCCESS

    def outcome_of(self, child: Any) -> Status:
        """Return the status of a child as that of this node, with its failure or its skip."""
        if child.status is Status.FAILURE:
            return self.execution.propagate_failure(self, child)
        status: Status = child.status
        return self.skip() if child.was_skipped else status

    def _fail(self, error: Exception) -> Status:
        """Halt the children; return FAILURE because of a missing or invalid value."""
        for child in self.children:
            halt(child)
        code = error.code if isinstance(error, EvaluationError) else FailureCode.FAILED
        return self.execution.fail(self, Failure(code, str(error)))

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Set the status; a halted node halts its children."""
        if new_status is _INVALID:
            self.reset()
        self.terminate(new_status)
        self.status = new_status

    def terminate(self, new_status: Status) -> None:
        """Record a halt at once; `execute_tick` records other changes."""
        if new_status is _INVALID:
            self.execution.set_status(self, new_status)

    def reset(self) -> None:
        """Halt all children before a new run."""
        for child in self.children:
            if child.status is not _INVALID:
                child.stop(_INVALID)


class Decorator(InnerNode, PyTreesDecorator):
    """An inner node with one child; the child is halted before the node."""

    child: Any
    """A Node; py_trees declares a Behaviour."""

    def __init__(self, name: str, child: Behaviour, execution: Execution) -> None:
        super().__init__(name, child)
        self.child, self.execution = child, execution

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Set the status; halt the child if it is running or this node is halted."""
        if new_status is Status.INVALID or self.child.status is Status.RUNNING:
            halt(self.child)
        self.terminate(new_status)
        self.status = new_status

    def outcome_of_child(self) -> Status:
        """Return the status of the child as that of this node, with its failure or its skip."""
        return self.outcome_of(self.child)

    def reset_finished_child(self) -> None:
        """Reset a finished child, so that its next run is a new run."""
        if self.child.status is not Status.RUNNING:
            halt(self.child)
