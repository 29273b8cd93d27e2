"""Composites. A pre-empted node is halted before any other node starts.

`sequence` and `fallback` resume at the running child; the reactive ones tick their children from
the first one on every tick. A reactive composite only knows that an earlier child pre-empts the
running child after it has ticked the earlier one. Therefore the running child is kept as
pre-emptible meanwhile: it is halted before a behaviour that claims a part of the robot starts in
the earlier child, and otherwise as soon as the earlier child ends the tick.

A skipped child (`when`) has no outcome: every composite continues with the next child. A composite
whose children were all skipped is skipped itself.
"""

from __future__ import annotations

from collections.abc import Sequence as Items
from typing import Any, ClassVar

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.trees.context import Execution, HandledFailure, halt
from missions.trees.node import InnerNode

_RUNNING, _SUCCESS, _FAILURE = Status.RUNNING, Status.SUCCESS, Status.FAILURE


class OrderedComposite(InnerNode):
    """Ticks children in order while they end with `continue_on`.

    Its other base class is that of py_trees.

    Attributes:
        handled: holds the failures of children for those after them; None if nothing reads it.
        position: the last child that was ticked in the previous tick; later ones are idle.
    """

    continue_on: ClassVar[Status]
    has_memory: ClassVar[bool]

    def __init__(
        self, name: str, children: Items[Behaviour], execution: Execution,
        handled: HandledFailure | None = None,
    ) -> None:  # fmt: skip
        super().__init__(name, memory=self.has_memory, children=children)  # type: ignore[call-arg]
        self.execution, self.handled, self.position = execution, handled, 0


class MemoryComposite(OrderedComposite):
    """Resumes at the running child."""

    has_memory = True

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
            halt_all(children[number + 1 : before + 1])
        return status if status is _RUNNING else _outcome(self, child, status)


class ReactiveComposite(OrderedComposite):
    """Begins with the first child on every tick."""

    has_memory = False

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
            halt_all(children[number + 1 : before + 1])
        return status if status is _RUNNING else _outcome(self, child, status)


def _outcome(node: Any, child: Any, status: Status) -> Status:
    """Return the outcome of a composite with ordered children, whose last ticked child is given.

    If that child was skipped, the children before it decide: all of them have ended alike.
    """
    if child.skipped and status is _SUCCESS:
        earlier = node.children[: node.position]
        ended = [one for one in earlier if not one.was_skipped]
        if not ended:
            return node.skip()  # type: ignore[no-any-return]
        child, status = ended[-1], ended[-1].status
    return node.execution.propagate_failure(node, child) if status is _FAILURE else status


def halt_all(children: Items[Behaviour]) -> None:
    """Halt children that were ticked before and are not ticked now."""
    for child in children:
        halt(child)
