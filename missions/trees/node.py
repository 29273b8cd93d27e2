"""Base classes of all inner nodes, which tick by direct calls.

py_trees ticks with nested generators: each visited node is handed up through every node above it.
Here a node calls `execute_tick` of its child and gets the status back. `tick`, the generator that
py_trees' own tools call, is built on it.
"""

from __future__ import annotations

from collections.abc import Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator as PyTreesDecorator

from missions.language.expressions.scope import NotSet
from missions.trees.context import Execution, Record, halt
from stack.errors import ParameterError
from stack.types import Failure, FailureCode

_RUNNING, _INVALID = Status.RUNNING, Status.INVALID


def run(node: Behaviour) -> Status:
    """Tick a node of a compiled tree and all below it that has a turn."""
    return node.execute_tick()  # type: ignore[attr-defined, no-any-return] # leaves get it by LeafNode


class Node(Behaviour):
    """An inner node: `advance` says what one tick does, the rest is the same for all.

    The tree that the node becomes part of sets `record`.
    """

    execution: Execution
    record: Record

    def advance(self, fresh: bool) -> Status:
        """One tick; `fresh` when the node was not running before."""
        raise NotImplementedError

    def execute_tick(self) -> Status:
        """Tick what is to be ticked below; a value that is missing is this node's failure."""
        execution = self.execution
        fresh = self.status is not _RUNNING
        if fresh:
            self.feedback_message = ""
            if execution.starts is not None:
                execution.starts(self)
        try:
            status = self.advance(fresh)
        except (NotSet, ArithmeticError, ParameterError) as error:
            for child in self.children:
                halt(child)
            status = execution.fail(self, Failure(FailureCode.FAILED, str(error)))
        if status is not _RUNNING:
            self.stop(status)
        elif fresh:
            self.status = status
        record = self.record
        if record.status is not status:
            execution.changed(record, status)
        if execution.visited is not None:
            execution.visited.append((self, status))
        return status

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Bring all below to rest when the node itself is halted."""
        if new_status is _INVALID:
            self.reset()
        self.terminate(new_status)
        self.status = new_status

    def tick(self) -> Iterator[Behaviour]:
        """As `execute_tick`, and yields the nodes that were ticked, as py_trees does."""
        visited: list[tuple[Behaviour, Status]] = []
        self.execution.visited = visited
        self.execute_tick()
        self.execution.visited = None
        yield from (node for node, _ in visited)

    def update(self) -> Status:
        """Nothing of its own: `advance` decides."""
        return self.status

    def terminate(self, new_status: Status) -> None:
        """Make a halt known at once; other changes are known when the node has answered."""
        if new_status is _INVALID:
            self.execution.became(self, new_status)

    def reset(self) -> None:
        """Bring all children to rest before a new run."""
        for child in self.children:
            if child.status is not _INVALID:
                child.stop(_INVALID)

    def postpone(self, seconds: float) -> None:
        """Move what the node waits for into the future: it was interrupted for that long."""


class Decorator(Node, PyTreesDecorator):
    """An inner node with one child, which is always halted before the node itself."""

    def __init__(self, name: str, child: Behaviour, execution: Execution) -> None:
        super().__init__(name, child)
        self.child, self.execution = child, execution

    def stop(self, new_status: Status = Status.INVALID) -> None:
        """Halt the child if it runs, or when this node is halted itself."""
        if new_status is Status.INVALID or self.child.status is Status.RUNNING:
            halt(self.child)
        self.terminate(new_status)
        self.status = new_status

    def start_child_afresh(self) -> None:
        """A finished child forgets its outcome, so that its next run shows as a run."""
        if self.child.status is not Status.RUNNING:
            halt(self.child)
