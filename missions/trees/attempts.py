"""Decorators that try again: `retry` and `recover`. At most one attempt per tick."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from collections.abc import Sequence as Items
from dataclasses import dataclass
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from behaviours.timer import Timer
from missions.trees.context import Execution, HandledFailure, halt
from missions.trees.node import Decorator, InnerNode, run
from stack.types import Expression


@dataclass(slots=True)
class Attempts:
    """The number of attempts allowed and the current one, which `attempt` reads."""

    most: Callable[[], int]
    number: int = 1


class Retry(Decorator):
    """Runs the child again `delay` seconds after a failure; fails with the last failure."""

    def __init__(
        self, name: str, child: Behaviour, execution: Execution, attempts: Attempts,
        delay: Callable[[], float],
    ) -> None:  # fmt: skip
        super().__init__(name, child, execution)
        self.attempts, self.delay, self.seconds = attempts, delay, 0.0
        self.timer = Timer(execution)

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.attempts.number, self.seconds = 1, 0.0
            self.timer.restart()
        if self.child.status is not Status.RUNNING:
            if not self.timer.is_over(self.seconds):
                return Status.RUNNING
            halt(self.child)
        run(self.child)
        if self.child.status is not Status.FAILURE:
            return self.outcome_of_child()
        most = self.attempts.most()
        if self.attempts.number >= most:
            return self.execution.propagate_failure(self, self.child)
        self.attempts.number += 1
        self.seconds = self.delay()
        self.timer.restart()
        self.feedback_message = f"attempt {self.attempts.number} of {most}"
        return Status.RUNNING

    def timers(self) -> Iterable[Timer]:
        return (self.timer,)


class Recover(InnerNode, composites.Composite):
    """Runs the first child; after a failure runs the next recovery, then the first child again.

    A recovery starts in the tick of the failure, the next attempt in the tick after the recovery.
    A failed recovery does not end the node. It fails with the failure of the last attempt. Every
    run starts with the first recovery. A skipped recovery passes its turn on, in the same tick.
    """

    def __init__(  # noqa: PLR0913 - one call from one place
        self, name: str, children: Items[Behaviour], execution: Execution, attempts: Attempts,
        unless: Expression | None, handled: HandledFailure,
    ) -> None:  # fmt: skip
        super().__init__(name, children)
        self.execution, self.attempts, self.unless = execution, attempts, unless
        self.handled = handled
        self.recoveries, self.turn = self.children[1:], 0

    def advance(self, fresh: bool) -> Status:
        first: Any = self.children[0]
        if fresh:
            self.reset()
            self.attempts.number, self.turn = 1, 0
            self.current_child = first
            self.handled.code = ""
        is_attempt = self.current_child is first
        if is_attempt:
            halt_if_done(first)
            run(first)
            if first.status is not Status.FAILURE:
                return self.outcome_of(first)
            self.handled.code = self.execution.code_of(first)
            if self.attempts.number >= self.attempts.most() or (self.unless and self.unless()):
                return self.execution.propagate_failure(self, first)
            self._next_recovery()
        elif self.current_child is not None:
            run(self.current_child)
        recovery = self.current_child
        if recovery is not first and recovery is not None and recovery.status is Status.RUNNING:
            return Status.RUNNING
        self.current_child = first
        self.attempts.number += 1
        return Status.RUNNING

    def _next_recovery(self) -> None:
        """Run the next recovery that is not skipped, if there is one."""
        for _ in self.recoveries:
            recovery: Any = self.recoveries[self.turn % len(self.recoveries)]
            self.turn += 1
            halt_if_done(recovery)
            self.current_child = recovery
            run(recovery)
            if not recovery.was_skipped:
                self._report(recovery)
                return

    def _report(self, recovery: Behaviour) -> None:
        self.execution.recoveries += 1
        why = self.execution.trace(self.children[0]).failure
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
    """Reset a finished node, so that its next run is a new run."""
    if node.status is not Status.RUNNING:
        halt(node)
