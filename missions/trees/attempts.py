"""Nodes that try again: `retry` and `recover`. One attempt per tick at most."""

from __future__ import annotations

from collections.abc import Callable
from collections.abc import Sequence as Items
from dataclasses import dataclass

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.trees.context import Execution, halt
from missions.trees.decorators import TOLERANCE
from missions.trees.node import Decorator, Node, run
from stack.types import Expression


@dataclass(slots=True)
class Attempts:
    """How many attempts there are, and the one under way: what `attempt` reads."""

    most: Callable[[], int]
    number: int = 1


class Retry(Decorator):
    """Tries the child again after a failure, `delay` seconds later; the last failure is its own."""

    def __init__(
        self, child: Behaviour, execution: Execution, attempts: Attempts,
        delay: Callable[[], float],
    ) -> None:  # fmt: skip
        super().__init__("retry", child, execution)
        self.attempts, self.delay, self.resume_at = attempts, delay, 0.0

    def advance(self, fresh: bool) -> Status:
        now = self.execution.time
        if fresh:
            self.attempts.number, self.resume_at = 1, now
        if self.child.status is not Status.RUNNING:
            if now < self.resume_at - TOLERANCE:
                return Status.RUNNING
            halt(self.child)
        run(self.child)
        if self.child.status is not Status.FAILURE:
            return self.child.status
        most = self.attempts.most()
        if self.attempts.number >= most:
            return self.execution.pass_on(self, self.child)
        self.attempts.number += 1
        self.resume_at = now + self.delay()
        self.feedback_message = f"attempt {self.attempts.number} of {most}"
        return Status.RUNNING

    def postpone(self, seconds: float) -> None:
        self.resume_at += seconds


class Recover(Node, composites.Composite):
    """After a failure of its first child, runs the next of the others, then tries again.

    A recovery starts in the tick of the failure, the next attempt in the tick after the recovery.
    A recovery that fails does not end it; the failure of the last attempt is its own. Recoveries
    go round from the first one in every run.
    """

    def __init__(
        self, children: Items[Behaviour], execution: Execution, attempts: Attempts,
        unless: Expression | None,
    ) -> None:  # fmt: skip
        super().__init__("recover", children)
        self.execution, self.attempts, self.unless = execution, attempts, unless
        self.recoveries, self.turn = self.children[1:], 0

    def advance(self, fresh: bool) -> Status:
        first = self.children[0]
        if fresh:
            self.reset()
            self.attempts.number, self.turn, self.current_child = 1, 0, first
        if self.current_child is first:
            halt_if_done(first)
            run(first)
            if first.status is not Status.FAILURE:
                return first.status
            self.execution.deal_with(first)
            if self.attempts.number >= self.attempts.most() or (self.unless and self.unless()):
                return self.execution.pass_on(self, first)
            self._next_recovery()
        recovery = self.current_child
        assert recovery is not None
        if recovery is not first:
            run(recovery)
            if recovery.status is Status.RUNNING:
                return Status.RUNNING
        self.current_child = first
        self.attempts.number += 1
        return Status.RUNNING

    def _next_recovery(self) -> None:
        if not self.recoveries:
            return
        recovery = self.recoveries[self.turn % len(self.recoveries)]
        self.turn += 1
        halt_if_done(recovery)
        self.current_child = recovery
        self.execution.recoveries += 1
        why = self.execution.trail(self.children[0]).failure
        self.feedback_message = f"{recovery.name} after {why.code}"
        self.execution.emit(
            level="info", kind="recovery",
            text=f"{recovery.name} after {why.code}: {why.sentence}",
            fields={
                "node": self.execution.record(recovery).id, "name": recovery.name,
                "attempt": self.attempts.number, "code": str(why.code),
            },
        )  # fmt: skip


def halt_if_done(node: Behaviour) -> None:
    """A finished node forgets its outcome, so that its next run shows as a run."""
    if node.status is not Status.RUNNING:
        halt(node)
