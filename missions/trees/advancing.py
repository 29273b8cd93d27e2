"""How all inner nodes tick: one way for composites and decorators."""

from __future__ import annotations

from collections.abc import Generator, Iterator

from py_trees.behaviour import Behaviour
from py_trees.common import Status
from py_trees.decorators import Decorator as PyTreesDecorator

from missions.language.scope import NotSet
from missions.trees.execution import Execution, halt
from stack.errors import ParameterError
from stack.types import Failure, FailureCode

Advance = Generator[Behaviour, None, Status]
"""Yields the nodes that were ticked, as py_trees does, and returns the node's own status."""


class Advancing(Behaviour):
    """An inner node: `advance` says what one tick does, the rest is the same for all."""

    execution: Execution

    def advance(self, fresh: bool) -> Advance:
        """One tick; `fresh` when the node was not running before."""
        raise NotImplementedError

    def tick(self) -> Iterator[Behaviour]:
        """Tick what is to be ticked below; a value that is missing is this node's failure."""
        fresh = self.status is not Status.RUNNING
        if fresh:
            self.feedback_message = ""
        try:
            status = yield from self.advance(fresh)
        except (NotSet, ArithmeticError, ParameterError) as error:
            for child in self.children:
                halt(child)
            status = self.execution.fail(self, Failure(FailureCode.FAILED, str(error)))
        if status is not Status.RUNNING:
            self.stop(status)
        self.status = status
        yield self

    def update(self) -> Status:
        """Nothing of its own: `advance` decides."""
        return self.status

    def terminate(self, new_status: Status) -> None:
        """Make a halt known at once; other changes are known when the node has answered."""
        if new_status is Status.INVALID:
            self.execution.became(self, new_status)

    def reset(self) -> None:
        """Bring all children to rest before a new run."""
        for child in self.children:
            halt(child)


class Decorator(Advancing, PyTreesDecorator):
    """An inner node with one child, which is always halted before the node itself."""

    def __init__(self, name: str, child: Behaviour, execution: Execution) -> None:
        super().__init__(name, child)
        self.child, self.execution = child, execution

    def stop(self, new_status: Status) -> None:
        """Halt the child if it runs, or when this node is halted itself."""
        if new_status is Status.INVALID or self.child.status is Status.RUNNING:
            halt(self.child)
        self.terminate(new_status)
        self.status = new_status
        self.iterator = self.tick()

    def start_child_afresh(self) -> None:
        """A finished child forgets its outcome, so that its next run shows as a run."""
        if self.child.status is not Status.RUNNING:
            halt(self.child)
