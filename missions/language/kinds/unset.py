"""`unset`: removes the values of keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from py_trees.behaviour import Behaviour
from py_trees.common import Status

from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import UNSET as NO_VALUE
from missions.language.expressions.scope import Symbol
from missions.language.expressions.value_types import ANYTHING
from missions.language.kinds.kind import NodeKind, NodeReading, Outline, Shape, Written
from missions.language.step import Outcomes, Step, TreeBuilder
from missions.language.values import Value
from missions.trees.leaves import LeafNode
from missions.trees.node import Node
from missions.trees.slots import Frame


class UnsetKeys(Behaviour):
    """`unset`: removes the values of keys.

    Args:
        name: label.
        writers: writers of the keys.
    """

    def __init__(self, name: str, writers: Iterable[Callable[[Any], None]]) -> None:
        super().__init__(name)
        self.writers = tuple(writers)

    def update(self) -> Status:
        """Remove the values."""
        for write in self.writers:
            write(None)
        return Status.SUCCESS


@dataclass(frozen=True, slots=True)
class UnsetStep(Step):
    """`unset: $photo`: removes the values of keys."""

    targets: tuple[Symbol, ...]

    def children(self) -> tuple[Step, ...]:
        return ()

    def reads(self) -> Iterator[Value]:
        return iter(())

    def writes(self) -> tuple[Symbol, ...]:
        return ()

    def unsets(self) -> tuple[Symbol, ...]:
        return self.targets

    def outcomes(self, children: Sequence[Outcomes]) -> Outcomes:
        return Outcomes(failure=False)

    def least_time(self, children: Sequence[float]) -> float:
        return 0.0

    @property
    def ends_at_once(self) -> bool:
        return True

    @property
    def own_name(self) -> str:
        return self.kind

    @property
    def detail(self) -> str:
        return ", ".join(f"${symbol.name}" for symbol in self.targets)

    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        writers = [frame.writers[symbol] for symbol in self.targets]
        return LeafNode(UnsetKeys(self.name or self.kind, writers), builder.execution)


def _read(reader: NodeReading, written: Written, context: NameContext) -> Step | None:
    """Read `unset: $photo` or a list."""
    head, body = written.head, written.body
    if body is None or (body.kind == "scalar" and body.value is None) or body.is_mapping:
        got = "nothing" if body is None else body.words()
        reader.findings.add("E171", head.mark, f"unset needs a $key or a list, got {got}")
        return None
    targets: list[Symbol] = []
    for item in body.items if body.is_sequence else [body]:
        symbol = reader.values.target(item, context, ANYTHING)
        if symbol is None:
            continue
        if symbol.value is not NO_VALUE:
            sentence = f"${symbol.name} has an initial value and cannot be unset"
            hint = "remove `initial` and declare it `optional: true`, or use `set`"
            reader.findings.add("E171", item.mark, sentence, hint)
        targets.append(symbol)
    return UnsetStep(*head, tuple(targets))


UNSET = NodeKind(
    "unset", "removes the values of keys without `initial`: `unset: $photo` or a list",
    Shape.NOTHING, "∅", Outline.ELLIPSE, LeafNode,
    "{unset: $k}\nblackboard: {k: {type: int, optional: true}}",
    also_known_as=("UnsetBlackboard", "UnsetBlackboardVariable"), read=_read, step=UnsetStep,
)  # fmt: skip
