"""What `sequence`, `fallback`, `parallel` and their relatives share: a list of children."""

from __future__ import annotations

from abc import ABC
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Symbol
from missions.language.kinds.kind import NodeReading, Read, Written
from missions.language.step import Order, Outcomes, Step, TreeBuilder
from missions.language.values import Value
from missions.trees.context import HandledFailure
from missions.trees.node import Node
from missions.trees.slots import Frame


@dataclass(frozen=True, slots=True)
class CompositeStep(Step, ABC):
    """A node with a list of children."""

    nodes: tuple[Step, ...]

    def children(self) -> tuple[Step, ...]:
        return self.nodes

    def reads(self) -> Iterator[Value]:
        return iter(())

    def writes(self) -> tuple[Symbol, ...]:
        return ()

    def outcomes(self, children: Sequence[Outcomes]) -> Outcomes:
        succeed, fail = any(end.success for end in children), any(end.failure for end in children)
        all_run = all(end.next_may_run(self.order) for end in children)
        skip = all(end.skip for end in children)
        if self.order is Order.AFTER_SUCCESS:
            return Outcomes(succeed and all_run, fail, skip)
        return Outcomes(succeed, fail and all_run, skip)

    @property
    def detail(self) -> str:
        return ""

    def build_children(self, builder: TreeBuilder, frame: Frame) -> list[Node]:
        """Return the nodes of the children."""
        return [builder.step(child, frame) for child in self.nodes]


def with_handled_failure(
    node: Any, step: CompositeStep, builder: TreeBuilder, frame: Frame
) -> Node:
    """Build a node of a class; all children but the first may see the `error` of another."""
    handled = HandledFailure(frame.handled)
    later = frame.handling(handled)
    first, *rest = step.nodes
    children = [builder.step(first, frame), *(builder.step(child, later) for child in rest)]
    found: Node = node(step.name or step.kind, children, builder.execution, handled)
    return found


def read_list(step: type[CompositeStep]) -> Read:
    """Return the reader of a kind whose value is a list of nodes."""

    def read(reader: NodeReading, written: Written, context: NameContext) -> Step:
        return step(*written.head, reader.children(written.body, written.head, context, step.order))

    return read
