"""`fallback` and `reactive_fallback`: children in order until one succeeds."""

from __future__ import annotations

from collections.abc import Sequence as Items
from dataclasses import dataclass

from py_trees import composites
from py_trees.common import Status

from missions.language.kinds.composite import CompositeStep, read_list, with_handled_failure
from missions.language.kinds.kind import NodeKind, Outline, Shape
from missions.language.step import Order, TreeBuilder
from missions.trees.composites import MemoryComposite, ReactiveComposite
from missions.trees.node import Node
from missions.trees.slots import Frame


class Fallback(MemoryComposite, composites.Selector):
    """Children in order until one succeeds; resumes at the running child."""

    continue_on = Status.FAILURE


class ReactiveFallback(ReactiveComposite, composites.Selector):
    """Children from the first one on every tick, until one succeeds or is running."""

    continue_on = Status.FAILURE


@dataclass(frozen=True, slots=True)
class FallbackStep(CompositeStep):
    """Children in order until one succeeds."""

    order = Order.AFTER_FAILURE
    without_sibling = "there is no alternative to {child}"

    def least_time(self, children: Items[float]) -> float:
        return min(children, default=0.0)

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        return with_handled_failure(Fallback, self, builder, frame)


@dataclass(frozen=True, slots=True)
class ReactiveFallbackStep(FallbackStep):
    """Children in order until one succeeds, from the first one on every tick."""

    starts_again = True

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        return with_handled_failure(ReactiveFallback, self, builder, frame)


FALLBACK = NodeKind(
    "fallback", "children in order until one succeeds; the next tick resumes at the running child",
    Shape.CHILDREN, "?", Outline.OCTAGON, Fallback, "{fallback: [{say: a}]}",
    keeps="the running child", also_known_as=("Selector", "try"),
    read=read_list(FallbackStep), step=FallbackStep,
)  # fmt: skip
REACTIVE_FALLBACK = NodeKind(
    "reactive_fallback", "as `fallback`, but every tick starts at the first child",
    Shape.CHILDREN, "⁇", Outline.OCTAGON, ReactiveFallback, "{reactive_fallback: [{say: a}]}",
    read=read_list(ReactiveFallbackStep), step=ReactiveFallbackStep,
)  # fmt: skip
