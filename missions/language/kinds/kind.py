"""What a kind of node states about itself, and the reader that it gets."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum, auto
from typing import Protocol

from behaviours.catalogue import Catalogue
from missions.language.expressions.expression import NameContext
from missions.language.expressions.scope import Symbol
from missions.language.keys import Keys
from missions.language.reading.modifiers import RawModifiers
from missions.language.reading.ports import PortReader
from missions.language.reading.values import ValueReader
from missions.language.step import Head, Order, Step, Tree
from stack.documents import Findings, Node
from stack.parameters import Declaration


class Shape(StrEnum):
    """What a node has below it."""

    CHILDREN = auto()
    """A list of nodes."""
    LOOP = auto()
    """One node under `do`, run for each item."""
    TREE = auto()
    """The root of the tree that it names."""
    CASES = auto()
    """One node for each case."""
    NOTHING = auto()
    CHILD = auto()
    """One node that it controls; made by a modifier or an event."""


class Outline(StrEnum):
    """Outline of a node in drawings by Graphviz."""

    BOX = auto()
    OCTAGON = auto()
    PARALLELOGRAM = auto()
    HEXAGON = auto()
    FOLDER = auto()
    HOUSE = auto()
    ELLIPSE = auto()


class NodeReading(Protocol):
    """The reader of nodes, for the kinds."""

    values: ValueReader
    ports: PortReader
    findings: Findings
    catalogue: Catalogue
    trees: Mapping[str, Tree]
    known: dict[str, tuple[str, ...]]
    """Words that can stand as the type of a node, with their names elsewhere."""

    def read(self, node: Node, context: NameContext) -> Step | None:
        """Read a node; None after a finding."""
        ...

    def children(
        self, node: Node | None, head: Head, context: NameContext, order: Order
    ) -> tuple[Step, ...]:
        """Read a list of nodes that run in this order; report and skip invalid ones."""
        ...

    def child(
        self, entry: tuple[Node, Node] | None, head: Head, context: NameContext
    ) -> Step | None:
        """Read the node under `do`."""
        ...

    def skim(self, node: Node | None, context: NameContext) -> None:
        """Read a node for its words only: it stands where it has no effect."""
        ...

    def warn_of_hiding(self, symbol: Symbol, context: NameContext) -> None:
        """Report a name that hides one of an outer scope."""
        ...


@dataclass(frozen=True, slots=True)
class Written:
    """A node as written.

    Attributes:
        head: what every node has.
        body: the value of its type.
        raw: the keys beside its type.
    """

    head: Head
    body: Node | None
    raw: RawModifiers


Read = Callable[[NodeReading, Written, NameContext], Step | None]


@dataclass(frozen=True, slots=True)
class NodeKind:
    """One kind of node.

    Attributes:
        word: as written in a mission, and as the kind of a row of the tree.
        glyph: one character in the dashboard.
        node: its class in the tree.
        keeps: what it remembers from one tick to the next.
        ports, outputs: declarations of its ports and outputs.
        keys: keys below it, besides ports.
        empty: why its children never started although it was reached; "" if that depends on them.
        takes_outputs: whether `out` can stand beside it.
        takes_inputs: whether `with` can stand beside it.
        also_known_as: its names in BehaviorTree.CPP, Nav2, py_trees and everyday language.
        example: the value of `run` in a mission that has this node, and further sections.
        read: reads it; None for a kind that a modifier or `events` adds.
        step: its class in the model.
    """

    word: str
    doc: str
    shape: Shape
    glyph: str
    outline: Outline
    node: type
    example: str
    keeps: str = ""
    ports: Mapping[str, Declaration] = field(default_factory=dict)
    outputs: Mapping[str, Declaration] = field(default_factory=dict)
    keys: Keys = field(default_factory=dict)
    empty: str = ""
    takes_outputs: bool = False
    takes_inputs: bool = False
    also_known_as: tuple[str, ...] = ()
    read: Read | None = None
    step: type[Step] | None = None

    def __post_init__(self) -> None:
        """Refuse a kind whose class lacks a method.

        Raises:
            TypeError: an abstract method of `Step` has no definition.
        """
        if self.step is not None and inspect.isabstract(self.step):
            missing = ", ".join(sorted(self.step.__abstractmethods__))
            raise TypeError(f"{self.step.__name__} lacks {missing}")

    @property
    def is_loop(self) -> bool:
        """Whether it runs `do` for each item; its `on_failure` applies to each item."""
        return self.shape is Shape.LOOP
