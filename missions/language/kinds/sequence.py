"""`sequence` and `reactive`: children in order while they succeed."""

from __future__ import annotations

from collections.abc import Iterator
from collections.abc import Sequence as Items
from dataclasses import dataclass
from itertools import pairwise

from py_trees import composites
from py_trees.common import Status

from missions.language.kinds.composite import CompositeStep, read_list
from missions.language.kinds.kind import NodeKind, Outline, Shape
from missions.language.step import Order, Step, TreeBuilder
from missions.trees.composites import MemoryComposite, ReactiveComposite
from missions.trees.node import Node
from missions.trees.slots import Frame
from stack.documents import Finding


class Sequence(MemoryComposite, composites.Sequence):
    """Children in order until one fails; resumes at the running child."""

    continue_on = Status.SUCCESS


class ReactiveSequence(ReactiveComposite, composites.Sequence):
    """Children from the first one on every tick, until one fails or is running."""

    continue_on = Status.SUCCESS


@dataclass(frozen=True, slots=True)
class SequenceStep(CompositeStep):
    """Children in order until one fails."""

    order = Order.AFTER_SUCCESS

    def least_time(self, children: Items[float]) -> float:
        return sum(children)

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        children = self.build_children(builder, frame)
        return Sequence(self.name or self.kind, children, builder.execution)

    def problems(self) -> Iterator[Finding]:
        for first, second in pairwise(self.nodes):
            yield from _same_drive(first, second)


@dataclass(frozen=True, slots=True)
class ReactiveStep(CompositeStep):
    """Children in order until one fails, from the first one on every tick."""

    order = Order.AFTER_SUCCESS
    starts_again = True
    without_sibling = "there is no condition that {child} depends on"

    def least_time(self, children: Items[float]) -> float:
        return max(children, default=0.0)

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        children = self.build_children(builder, frame)
        return ReactiveSequence(self.name or self.kind, children, builder.execution)


def _same_drive(first: Step, second: Step) -> Iterator[Finding]:
    """Report a drive to the goal that the node before has just reached."""
    modifiers = first.modifiers
    elsewhere = modifiers.keep_going or modifiers.invert or modifiers.finally_ is not None
    if first.goal is not None and first.goal == second.goal and not elsewhere:
        sentence = f"the robot is already there: line {first.mark.line} drives to the same goal"
        hint = "use another goal, or remove it"
        yield Finding(second.mark, "W134", sentence, hint)


SEQUENCE = NodeKind(
    "sequence", "children in order until one fails; the next tick resumes at the running child",
    Shape.CHILDREN, "→", Outline.BOX, Sequence, "{sequence: [{say: a}]}",
    keeps="the running child", also_known_as=("SequenceWithMemory",),
    read=read_list(SequenceStep), step=SequenceStep,
)  # fmt: skip
REACTIVE = NodeKind(
    "reactive", "as `sequence`, but every tick starts at the first child",
    Shape.CHILDREN, "⇉", Outline.BOX, ReactiveSequence, "{reactive: [{say: a}]}",
    also_known_as=("ReactiveSequence", "PipelineSequence"),
    read=read_list(ReactiveStep), step=ReactiveStep,
)  # fmt: skip
