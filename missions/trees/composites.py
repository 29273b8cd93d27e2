"""Composites. A pre-empted node is halted before any other node starts.

`sequence` and `fallback` resume at the running child; the reactive ones tick their children from
the first one on every tick. A reactive composite only knows that an earlier child pre-empts the
running child after it has ticked the earlier one. Therefore the running child is kept as
pre-emptible meanwhile: it is halted before a behaviour that moves the robot (`uses_wheels`) starts
in the earlier child, and otherwise as soon as the earlier child ends the tick.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Any, ClassVar

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from missions.trees.context import Execution, halt
from missions.trees.node import InnerNode, run

_RUNNING, _SUCCESS, _FAILURE = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class MemoryComposite(InnerNode):
    """Ticks children in order while they end with `continue_on`; resumes at the running child."""

    continue_on: ClassVar[Status]
    position = 0

    def advance(self, fresh: bool) -> Status:
        children: list[Any] = self.children
        before, continue_on = self.position, self.continue_on
        number = 0 if fresh else before
        while True:
            child = children[number]
            status: Status = child.execute_tick()
            if status is not continue_on:
                break
            if continue_on is _FAILURE:
                self.execution.set_error(child)
            if number + 1 == len(children):
                break
            number += 1
        self.current_child, self.position = child, number
        if before > number:
            _halt_all(children[number + 1 : before + 1])
        return self.execution.propagate_failure(self, child) if status is _FAILURE else status


class ReactiveComposite(InnerNode):
    """Ticks children from the first one, on every tick, while they end with `continue_on`.

    `position` is the last child that was ticked in the previous tick; later ones are idle.
    """

    continue_on: ClassVar[Status]
    position = 0

    def advance(self, fresh: bool) -> Status:
        children: list[Any] = self.children
        before, continue_on, execution = self.position, self.continue_on, self.execution
        preemptible = execution.preemptible
        depth = len(preemptible)
        if before and children[before].status is _RUNNING:
            preemptible.append(children[before])
        number = 0
        for number, child in enumerate(children):
            if number == before:
                del preemptible[depth:]
            status: Status = child.execute_tick()
            if status is not continue_on:
                break
            if continue_on is _FAILURE:
                execution.set_error(child)
        del preemptible[depth:]
        self.current_child, self.position = child, number
        if before > number:
            _halt_all(children[number + 1 : before + 1])
        return execution.propagate_failure(self, child) if status is _FAILURE else status


class Sequence(MemoryComposite, composites.Sequence):
    """Children in order until one fails; resumes at the running child."""

    continue_on = _SUCCESS

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=True, children=children)
        self.execution = execution


class Fallback(MemoryComposite, composites.Selector):
    """Children in order until one succeeds; resumes at the running child."""

    continue_on = _FAILURE

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=True, children=children)
        self.execution = execution


class ReactiveSequence(ReactiveComposite, composites.Sequence):
    """Children from the first one on every tick, until one fails or is running."""

    continue_on = _SUCCESS

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=False, children=children)
        self.execution = execution


class ReactiveFallback(ReactiveComposite, composites.Selector):
    """Children from the first one on every tick, until one succeeds or is running."""

    continue_on = _FAILURE

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=False, children=children)
        self.execution = execution


class Parallel(InnerNode, composites.Parallel):
    """Ticks all children until each has ended; ends as early as possible.

    Succeeds at the `needed`-th success; fails when that number can no longer be reached. Running
    children are then halted, and the remaining children are not ticked.
    """

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution, needed: int
    ) -> None:
        super().__init__(name, ParallelPolicy.SuccessOnAll(synchronise=True), list(children))
        self.execution, self.needed = execution, needed
        self.pending: list[Behaviour] = []
        self.succeeded = self.failed = 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.pending = list(self.children)
            self.succeeded = self.failed = 0
        ended = False
        children: list[Any] = self.pending
        for number, child in enumerate(children):
            status = child.execute_tick()
            if status is _RUNNING:
                continue
            ended = True
            self.succeeded += status is _SUCCESS
            self.failed += status is _FAILURE
            if self.succeeded >= self.needed or self.failed > len(self.children) - self.needed:
                if fresh:
                    _halt_all(children[number + 1 :])
                return self._decided(self.succeeded >= self.needed)
        if ended:
            self.pending = [child for child in children if child.status not in (_SUCCESS, _FAILURE)]
        return Status.RUNNING

    def _decided(self, success: bool) -> Status:
        for child in self.children:
            if child.status is Status.RUNNING:
                halt(child)
        if success:
            return Status.SUCCESS
        first = next(child for child in self.children if child.status is Status.FAILURE)
        return self.execution.propagate_failure(self, first)


class RoundRobin(InnerNode, composites.Composite):
    """One child per run, the next one in the next run; after a failure tries the others.

    Like Nav2's RoundRobin, it keeps its position after success, failure and halts.
    """

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, children)
        self.execution, self.position, self.tried = execution, 0, 0

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.reset()
            self.tried = 0
        while True:
            child = self.current_child = self.children[self.position]
            run(child)
            if child.status is Status.RUNNING:
                return Status.RUNNING
            self.position = (self.position + 1) % len(self.children)
            if child.status is Status.SUCCESS:
                return Status.SUCCESS
            self.execution.set_error(child)
            self.tried += 1
            if self.tried == len(self.children):
                return self.execution.propagate_failure(self, child)


def _halt_all(children: Items[Behaviour]) -> None:
    """Halt children that were ticked before and are not ticked now."""
    for child in children:
        halt(child)
