"""`round_robin`: one child per run, in rotation."""

from __future__ import annotations

from collections.abc import Sequence as Items
from dataclasses import dataclass
from typing import Any

from py_trees import composites
from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.kinds.composite import CompositeStep, read_list, with_handled_failure
from missions.language.kinds.kind import NodeKind, Outline, Shape
from missions.language.step import Order, TreeBuilder
from missions.trees.context import Execution, HandledFailure
from missions.trees.node import InnerNode, Node, run
from missions.trees.slots import Frame


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


@dataclass(frozen=True, slots=True)
class RoundRobinStep(CompositeStep):
    """One child per run, the others after its failure."""

    order = Order.IN_TURN
    without_sibling = "there is nothing to rotate"

    def least_time(self, children: Items[float]) -> float:
        return min(children, default=0.0)

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        return with_handled_failure(RoundRobin, self, builder, frame)


ROUND_ROBIN = NodeKind(
    "round_robin", "one child per run, in rotation; tries the others after a failure",
    Shape.CHILDREN, "↻", Outline.OCTAGON, RoundRobin, "{round_robin: [{say: a}]}",
    keeps="the child whose turn is next",
    read=read_list(RoundRobinStep), step=RoundRobinStep,
)  # fmt: skip
