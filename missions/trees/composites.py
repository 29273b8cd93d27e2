"""Composites. A pre-empted node is halted before any other node starts.

`sequence` and `fallback` resume at the running child; the reactive ones tick their children from
the first one on every tick. A reactive composite only knows that an earlier child pre-empts the
running child after it has ticked the earlier one. Therefore the running child is kept as
pre-emptible meanwhile: it is halted before a behaviour that moves the robot (`uses_wheels`) starts
in the earlier child, and otherwise as soon as the earlier child ends the tick.

A skipped child (`when`) has no outcome: every composite goes on to the next child. A composite
whose children were all skipped is skipped itself.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Any, ClassVar

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from missions.trees.context import Execution, HandledFailure, halt
from missions.trees.node import InnerNode, run
from stack.types import Failure, FailureCode

_RUNNING, _SUCCESS, _FAILURE = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class MemoryComposite(InnerNode):
    """Ticks children in order while they end with `continue_on`; resumes at the running child."""

    continue_on: ClassVar[Status]
    position = 0
    handled: HandledFailure | None = None

    def advance(self, fresh: bool) -> Status:
        children: list[Any] = self.children
        before, continue_on, handled = self.position, self.continue_on, self.handled
        number = 0 if fresh else before
        if fresh and handled is not None:
            handled.code = ""
        while True:
            child = children[number]
            status: Status = child.execute_tick()
            if status is not continue_on and not (child.skipped and status is _SUCCESS):
                break
            if handled is not None and status is _FAILURE:
                handled.code = self.execution.code_of(child)
            if number + 1 == len(children):
                break
            number += 1
        self.current_child, self.position = child, number
        if before > number:
            _halt_all(children[number + 1 : before + 1])
        return status if status is _RUNNING else _outcome(self, child, status)


class ReactiveComposite(InnerNode):
    """Ticks children from the first one, on every tick, while they end with `continue_on`.

    `position` is the last child that was ticked in the previous tick; later ones are idle.
    """

    continue_on: ClassVar[Status]
    position = 0
    handled: HandledFailure | None = None

    def advance(self, fresh: bool) -> Status:
        children: list[Any] = self.children
        before, continue_on, execution = self.position, self.continue_on, self.execution
        handled = self.handled
        if fresh and handled is not None:
            handled.code = ""
        preemptible = execution.preemptible
        depth = len(preemptible)
        if before and children[before].status is _RUNNING:
            preemptible.append(children[before])
        number = 0
        for number, child in enumerate(children):
            if number == before:
                del preemptible[depth:]
            status: Status = child.execute_tick()
            if status is not continue_on and not (child.skipped and status is _SUCCESS):
                break
            if handled is not None and status is _FAILURE:
                handled.code = execution.code_of(child)
        del preemptible[depth:]
        self.current_child, self.position = child, number
        if before > number:
            _halt_all(children[number + 1 : before + 1])
        return status if status is _RUNNING else _outcome(self, child, status)


class Sequence(MemoryComposite, composites.Sequence):
    """Children in order until one fails; resumes at the running child."""

    continue_on = _SUCCESS

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=True, children=children)
        self.execution = execution


class Fallback(MemoryComposite, composites.Selector):
    """Children in order until one succeeds; resumes at the running child."""

    continue_on = _FAILURE

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution,
        handled: HandledFailure | None = None,
    ) -> None:  # fmt: skip
        super().__init__(name, memory=True, children=children)
        self.execution, self.handled = execution, handled or HandledFailure()


class ReactiveSequence(ReactiveComposite, composites.Sequence):
    """Children from the first one on every tick, until one fails or is running."""

    continue_on = _SUCCESS

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=False, children=children)
        self.execution = execution


class ReactiveFallback(ReactiveComposite, composites.Selector):
    """Children from the first one on every tick, until one succeeds or is running."""

    continue_on = _FAILURE

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution,
        handled: HandledFailure | None = None,
    ) -> None:  # fmt: skip
        super().__init__(name, memory=False, children=children)
        self.execution, self.handled = execution, handled or HandledFailure()


class Parallel(InnerNode, composites.Parallel):
    """Ticks all children until each has ended; ends as early as possible.

    Succeeds at the `needed`-th success; fails when that number can no longer be reached, with the
    failure that came first. Running children are then halted, and the remaining children are not
    ticked. If all children are needed, these are all that are not skipped.
    """

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution, needed: int
    ) -> None:
        super().__init__(name, ParallelPolicy.SuccessOnAll(synchronise=True), list(children))
        self.execution, self.needed = execution, needed
        self.pending: list[Behaviour] = []
        self.succeeded = self.failed = self.left_out = 0
        self.first_failed: Behaviour | None = None

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.pending = list(self.children)
            self.succeeded = self.failed = self.left_out = 0
            self.first_failed = None
        ended = False
        children: list[Any] = self.pending
        for number, child in enumerate(children):
            status = child.execute_tick()
            if status is _RUNNING:
                continue
            ended = True
            self._count(child, status)
            decided = self._decision()
            if decided is not None:
                if fresh:
                    _halt_all(children[number + 1 :])
                return self._end(decided)
        if ended:
            self.pending = [child for child in children if child.status not in (_SUCCESS, _FAILURE)]
        return Status.RUNNING

    def _count(self, child: Any, status: Status) -> None:
        if status is _FAILURE:
            self.failed += 1
            self.first_failed = self.first_failed or child
        elif child.skipped:
            self.left_out += 1
        else:
            self.succeeded += 1

    def _decision(self) -> Status | None:
        """Return the outcome if it is certain: SUCCESS, FAILURE, or INVALID for a skip."""
        count = len(self.children)
        if self.left_out == count:
            return Status.INVALID
        needed = self.needed if self.needed < count else count - self.left_out
        if self.succeeded >= needed:
            return _SUCCESS
        return _FAILURE if self.failed + self.left_out > count - needed else None

    def _end(self, status: Status) -> Status:
        for child in self.children:
            if child.status is Status.RUNNING:
                halt(child)
        if status is Status.INVALID:
            return self.skip()
        if status is _SUCCESS:
            return status
        if self.first_failed is not None:
            return self.execution.propagate_failure(self, self.first_failed)
        sentence = (
            f"{self.needed} children must succeed, but {self.left_out} of {len(self.children)} "
            "are skipped"
        )
        return self.execution.fail(self, Failure(FailureCode.CHECK_FAILED, sentence))


class RoundRobin(InnerNode, composites.Composite):
    """One child per run, the next one in the next run; after a failure tries the others.

    Like Nav2's RoundRobin, it keeps its position after success, failure and halts. A skipped child
    passes its turn on.
    """

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution,
        handled: HandledFailure | None = None,
    ) -> None:  # fmt: skip
        super().__init__(name, children)
        self.execution, self.position, self.tried = execution, 0, 0
        self.handled = handled or HandledFailure()
        self.last_failed: Behaviour | None = None

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.reset()
            self.tried, self.last_failed, self.handled.code = 0, None, ""
        while True:
            child: Any = self.children[self.position]
            self.current_child = child
            run(child)
            if child.status is Status.RUNNING:
                return Status.RUNNING
            self.position = (self.position + 1) % len(self.children)
            if child.status is Status.SUCCESS and not child.skipped:
                return Status.SUCCESS
            if child.status is Status.FAILURE:
                self.last_failed, self.handled.code = child, self.execution.code_of(child)
            self.tried += 1
            if self.tried == len(self.children):
                if self.last_failed is None:
                    return self.skip()
                return self.execution.propagate_failure(self, self.last_failed)


def _outcome(node: Any, child: Any, status: Status) -> Status:
    """Return the outcome of a composite with ordered children, whose last ticked child is given.

    If that child was skipped, the children before it decide: all of them have ended alike.
    """
    if child.skipped and status is _SUCCESS:
        earlier = node.children[: node.position]
        ended = [one for one in earlier if not (one.skipped and one.status is _SUCCESS)]
        if not ended:
            return node.skip()  # type: ignore[no-any-return]
        child, status = ended[-1], ended[-1].status
    return node.execution.propagate_failure(node, child) if status is _FAILURE else status


def _halt_all(children: Items[Behaviour]) -> None:
    """Halt children that were ticked before and are not ticked now."""
    for child in children:
        halt(child)
