"""Composites. Whatever is pre-empted is at rest before anything else starts.

`sequence` and `fallback` remember where they were; the reactive ones look at their children from
the top on every tick. A reactive composite cannot know whether an earlier child will take over
before it has ticked it. So the running child stands by meanwhile: it is halted before a behaviour
that moves the robot (`uses_wheels`) starts anywhere in the earlier child, and otherwise as soon as
the earlier child has not let the tick pass on.
"""

from __future__ import annotations

from collections.abc import Sequence as Items

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import ParallelPolicy, Status

from missions.trees.advancing import Advancing, run
from missions.trees.execution import Execution, halt


class Sequence(Advancing, composites.Sequence):
    """Children in turn until one fails; goes on where it was."""

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=True, children=children)
        self.execution = execution

    def advance(self, fresh: bool) -> Status:
        return in_turn(self, Status.SUCCESS, fresh)


class Fallback(Advancing, composites.Selector):
    """Children in turn until one succeeds; goes on where it was."""

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=True, children=children)
        self.execution = execution

    def advance(self, fresh: bool) -> Status:
        return in_turn(self, Status.FAILURE, fresh)


class ReactiveSequence(Advancing, composites.Sequence):
    """Children from the top on every tick until one fails or is running."""

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=False, children=children)
        self.execution = execution

    def advance(self, fresh: bool) -> Status:
        return from_the_top(self, Status.SUCCESS, fresh)


class ReactiveFallback(Advancing, composites.Selector):
    """Children from the top on every tick until one succeeds or is running."""

    def __init__(self, name: str, children: Items[Behaviour], execution: Execution) -> None:
        super().__init__(name, memory=False, children=children)
        self.execution = execution

    def advance(self, fresh: bool) -> Status:
        return from_the_top(self, Status.FAILURE, fresh)


class Parallel(Advancing, composites.Parallel):
    """All children on every tick, each until it is done; decided as early as possible.

    Succeeds with the `needed`-th success, fails once that many are out of reach. What still runs is
    halted then, and children that had no turn yet in that tick get none.
    """

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution, needed: int
    ) -> None:
        super().__init__(name, ParallelPolicy.SuccessOnAll(synchronise=True), list(children))
        self.execution, self.needed = execution, needed

    def advance(self, fresh: bool) -> Status:
        if fresh:
            self.reset()
        for child in self.children:
            if child.status in (Status.SUCCESS, Status.FAILURE):
                continue
            run(child)
            status = self._verdict()
            if status is not Status.RUNNING:
                for other in self.children:
                    if other.status is Status.RUNNING:
                        halt(other)
                return status
        return Status.RUNNING

    def _verdict(self) -> Status:
        statuses = [child.status for child in self.children]
        if statuses.count(Status.SUCCESS) >= self.needed:
            return Status.SUCCESS
        if statuses.count(Status.FAILURE) > len(statuses) - self.needed:
            first = next(child for child in self.children if child.status is Status.FAILURE)
            return self.execution.pass_on(self, first)
        return Status.RUNNING


class RoundRobin(Advancing, composites.Composite):
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


def in_turn(node: Sequence | Fallback, goes_on: Status, fresh: bool) -> Status:
    """Children in turn as long as they end with `goes_on`, starting where the node was."""
    if fresh:
        node.reset()
        node.current_child = node.children[0]
    assert node.current_child is not None
    for child in node.children[node.children.index(node.current_child) :]:
        node.current_child = child
        run(child)
        if child.status is not goes_on:
            break
        if goes_on is Status.FAILURE:
            node.execution.deal_with(child)
    return _outcome(node, node.current_child)


def from_the_top(node: ReactiveSequence | ReactiveFallback, goes_on: Status, fresh: bool) -> Status:
    """All children again as long as they end with `goes_on`."""
    if fresh:
        node.reset()
    execution, child = node.execution, node.children[0]
    running = next((item for item in node.children if item.status is Status.RUNNING), None)
    for child in node.children:
        if child is running:
            running = None
        depth = len(execution.standing_by)
        if running is not None:
            execution.standing_by.append(running)
        run(child)
        del execution.standing_by[depth:]
        if child.status is not goes_on:
            break
        if goes_on is Status.FAILURE:
            execution.deal_with(child)
    node.current_child = child
    for later in node.children[node.children.index(child) + 1 :]:
        halt(later)
    return _outcome(node, child)


def _outcome(node: Advancing, child: Behaviour) -> Status:
    """The status of a node that ends as its last ticked child did."""
    if child.status is Status.FAILURE:
        return node.execution.pass_on(node, child)
    return child.status
