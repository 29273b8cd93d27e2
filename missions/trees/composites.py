"""Composites. Whatever is pre-empted is at rest before anything else starts.

`sequence` and `fallback` remember where they were; the reactive ones look at their children from
the top on every tick. A reactive composite cannot know whether an earlier child will take over
before it has ticked it. So the running child stands by meanwhile: it is halted before a behaviour
that moves the robot (`uses_wheels`) starts anywhere in the earlier child, and otherwise as soon as
the earlier child has not let the tick pass on.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Any, ClassVar

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from missions.trees.context import Execution, halt
from missions.trees.node import Node, run

_RUNNING, _SUCCESS, _FAILURE = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class InTurn(Node):
    """Children in turn as long as they end with `goes_on`; goes on where it was."""

    goes_on: ClassVar[Status]
    position = 0

    def advance(self, fresh: bool) -> Status:
        children: list[Any] = self.children
        before, goes_on = self.position, self.goes_on
        number = 0 if fresh else before
        while True:
            child = children[number]
            status: Status = child.execute_tick()
            if status is not goes_on:
                break
            if goes_on is _FAILURE:
                self.execution.deal_with(child)
            if number + 1 == len(children):
                break
            number += 1
        self.current_child, self.position = child, number
        if before > number:
            _forget(children[number + 1 : before + 1])
        return self.execution.pass_on(self, child) if status is _FAILURE else status


class FromTheTop(Node):
    """All children again on every tick as long as they end with `goes_on`.

    `position` is the last child that had a turn in the tick before: those behind it are at rest.
    """

    goes_on: ClassVar[Status]
    position = 0

    def advance(self, fresh: bool) -> Status:
        children: list[Any] = self.children
        before, goes_on, execution = self.position, self.goes_on, self.execution
        standing_by = execution.standing_by
        depth = len(standing_by)
        if before and children[before].status is _RUNNING:
            standing_by.append(children[before])
        number = 0
        for number, child in enumerate(children):
            if number == before:
                del standing_by[depth:]
            status: Status = child.execute_tick()
            if status is not goes_on:
                break
            if goes_on is _FAILURE:
                execution.deal_with(child)
        del standing_by[depth:]
        self.current_child, self.position = child, number
        if before > number:
            _forget(children[number + 1 : before + 1])
        return execution.pass_on(self, child) if status is _FAILURE else status


class Sequence(InTurn, composites.Sequence):
    """Children in turn until one fails; goes on where it was."""

    goes_on = _SUCCESS

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=True, children=children)
        self.execution = execution


class Fallback(InTurn, composites.Selector):
    """Children in turn until one succeeds; goes on where it was."""

    goes_on = _FAILURE

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=True, children=children)
        self.execution = execution


class ReactiveSequence(FromTheTop, composites.Sequence):
    """Children from the top on every tick until one fails or is running."""

    goes_on = _SUCCESS

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=False, children=children)
        self.execution = execution


class ReactiveFallback(FromTheTop, composites.Selector):
    """Children from the top on every tick until one succeeds or is running."""

    goes_on = _FAILURE

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=False, children=children)
        self.execution = execution


class Parallel(Node, composites.Parallel):
    """All children on every tick, each until it is done; decided as early as possible.

    Succeeds with the `needed`-th success, fails once that many are out of reach. What still runs is
    halted then, and children that had no turn yet in that tick get none.
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
                    _forget(children[number + 1 :])
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
        return self.execution.pass_on(self, first)


class RoundRobin(Node, composites.Composite):
    """One child per run, the next one in the next run; tries the others when it fails.

    As Nav2's RoundRobin: the position outlives success, failure and halts.
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
            self.execution.deal_with(child)
            self.tried += 1
            if self.tried == len(self.children):
                return self.execution.pass_on(self, child)


def _forget(children: Items[Behaviour]) -> None:
    """Bring to rest what had a turn before and has none now."""
    for child in children:
        halt(child)
