"""One node of a mission with its modifiers: what every kind of node answers to the analyses."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum, auto
from typing import ClassVar, NamedTuple, Protocol

from behaviours.base import RobotBehaviour
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import Symbol
from missions.language.values import Value, symbols_in
from missions.trees.context import Execution
from missions.trees.node import Node
from missions.trees.slots import Frame
from stack.documents import Finding, Mark
from stack.parameters import Declaration

Claims = frozenset[str]
"""Resources of the robot (stack.drivetrain.needs.RESOURCES)."""

Codes = frozenset[str] | None
"""Failure codes of a node; None if they are not known."""


class Order(Enum):
    """How the children of a node run."""

    NONE = auto()
    """There are none."""
    AFTER_SUCCESS = auto()
    """Each after the success of the one before."""
    AFTER_FAILURE = auto()
    """Each after the failure of the one before."""
    IN_TURN = auto()
    """One in each run, beginning with the next; the others after its failure."""
    TOGETHER = auto()
    """All at once."""
    ONE = auto()
    """One of them, chosen at the start."""
    REPEATED = auto()
    """One child, again and again."""

    @property
    def handles_failure(self) -> bool:
        """Whether a child can run after the failure of another: it sees `error`."""
        return self in (Order.AFTER_FAILURE, Order.IN_TURN)


@dataclass(frozen=True, slots=True)
class Outcomes:
    """The possible outcomes of a node; none at all means that it never ends."""

    success: bool = True
    failure: bool = True
    skip: bool = False

    def next_may_run(self, order: Order) -> bool:
        """Return whether the next child of a node may run after this one."""
        return self.skip or (self.success if order is Order.AFTER_SUCCESS else self.failure)


@dataclass(frozen=True, slots=True)
class Retry:
    """`retry: {attempts: 3, delay: 500 ms}`."""

    attempts: Value
    delay: Value


@dataclass(frozen=True, slots=True)
class Recover:
    """`recover: {attempts: 4, unless: …, round_robin: […]}`."""

    attempts: Value
    unless: CheckedExpression | None
    recoveries: tuple[Step, ...]


@dataclass(frozen=True, slots=True)
class Modifiers:
    """The modifiers of a node; None where a modifier is absent.

    Attributes:
        keep_going: `on_failure: continue`.
        repeat: number of runs; Constant(None) means forever, or until `until` is true.
        every: least time between two starts, seconds.
    """

    when: CheckedExpression | None = None
    finally_: Step | None = None
    while_: CheckedExpression | None = None
    keep_going: bool = False
    invert: bool = False
    repeat: Value | None = None
    until: CheckedExpression | None = None
    recover: Recover | None = None
    retry: Retry | None = None
    timeout: Value | None = None
    every: Value | None = None

    def conditions(self) -> Iterator[CheckedExpression]:
        """Yield the conditions."""
        unless = self.recover.unless if self.recover else None
        for condition in (self.when, self.while_, self.until, unless):
            if condition is not None:
                yield condition

    def values(self) -> Iterator[Value]:
        """Yield the numbers and durations."""
        retry, recover = self.retry, self.recover
        counts = (retry.attempts, retry.delay) if retry else ()
        most = recover.attempts if recover else None
        for value in (self.repeat, self.timeout, self.every, *counts, most):
            if value is not None:
                yield value


class Head(NamedTuple):
    """What every node has: the first fields of a step."""

    kind: str
    mark: Mark
    name: str
    modifiers: Modifiers


@dataclass(frozen=True, slots=True)
class Step(ABC):
    """One node of a mission file. Each kind of node is a subclass (missions.language.kinds).

    The methods that receive something of the children get it in the order of `children`; for a
    node that uses a tree they get it of the root of the tree.

    Attributes:
        kind: its type as written.
        mark: position of the type.
        name: label; "" without one.
    """

    kind: str
    mark: Mark
    name: str
    modifiers: Modifiers

    order: ClassVar[Order] = Order.NONE
    starts_again: ClassVar[bool] = False
    """Whether children that have ended start again within one run."""
    without_sibling: ClassVar[str] = ""
    """Why it has no effect with one `{child}`; "" if it has."""

    @abstractmethod
    def children(self) -> tuple[Step, ...]:
        """Return its children, without recoveries, `finally` and a used tree."""

    @abstractmethod
    def reads(self) -> Iterator[Value]:
        """Yield the values that it reads itself; those of the modifiers are not included."""

    @abstractmethod
    def writes(self) -> tuple[Symbol, ...]:
        """Return the symbols that it writes itself."""

    @abstractmethod
    def outcomes(self, children: Sequence[Outcomes]) -> Outcomes:
        """Return its possible outcomes, without its modifiers."""

    @abstractmethod
    def least_time(self, children: Sequence[float]) -> float:
        """Return the shortest time in which it can succeed, seconds."""

    @property
    @abstractmethod
    def detail(self) -> str:
        """Its ports and outputs as text in one line."""

    @abstractmethod
    def build(self, builder: TreeBuilder, frame: Frame) -> Node:
        """Return its node of the tree, with its children."""

    def takes_time(self, children: Sequence[bool]) -> bool:
        """Return whether it surely needs more than one tick to succeed."""
        return self.least_time([float(child) for child in children]) > 0.0

    def begins(self, children: Sequence[Claims]) -> Claims:
        """Return what it surely claims from its first tick on, of what its children then claim."""
        return children[0] if children else frozenset()

    @property
    def uses(self) -> str:
        """The tree that it runs; "" without one."""
        return ""

    @property
    def own_name(self) -> str:
        """What it is called besides `name`: its behaviour or tree; "" if only its kind."""
        return self.uses

    @property
    def names(self) -> tuple[str, ...]:
        """Its names, for mission tests."""
        return tuple(dict.fromkeys(name for name in (self.name, self.own_name) if name))

    @property
    def title(self) -> str:
        """Its name in sentences."""
        return self.name or self.own_name or self.kind

    @property
    def glyph(self) -> str:
        """Its character in the dashboard; "" for that of its kind."""
        return ""

    @property
    def runs_in_tests(self) -> bool:
        """Whether tests of missions run it unless they mock it."""
        return True

    @property
    def survives_failure(self) -> bool:
        """Whether the failure of a child is not always its own, or a child may never run."""
        return self.order.handles_failure or self.order is Order.ONE

    @property
    def ends_at_once(self) -> bool:
        """Whether it has no children and always ends in its first tick."""
        return False

    @property
    def waits(self) -> bool:
        """Whether it runs until its condition is true."""
        return False

    @property
    def claims(self) -> Claims:
        """What it claims of the robot itself."""
        return frozenset()

    @property
    def goal(self) -> object:
        """The goal, known before the mission runs, where the robot stands after it; or None."""
        return None

    def results(self) -> Mapping[str, Symbol]:
        """Return the targets of its outputs."""
        return {}

    def binds(self, inputs: Mapping[str, Symbol]) -> Iterator[tuple[Symbol, Value]]:
        """Yield the symbols for the nodes below with the value, or list of values, of each.

        Args:
            inputs: of the tree that it uses.
        """
        yield from ()

    def unsets(self) -> tuple[Symbol, ...]:
        """Return the keys whose values it removes."""
        return ()

    def changes(self) -> tuple[Symbol, ...]:
        """Return the symbols that it writes or unsets itself."""
        return (*self.writes(), *self.unsets())

    def symbols_read(self) -> Iterator[Symbol]:
        """Yield the symbols that it reads or tests, those of its modifiers included."""
        for condition in self.modifiers.conditions():
            yield from symbols_in(condition)
        for value in (*self.modifiers.values(), *self.reads()):
            yield from value.symbols()

    def variables(self) -> tuple[Symbol, ...]:
        """Return the symbols that it declares for its child and that the child must read."""
        return ()

    def conditions(self) -> Iterator[CheckedExpression]:
        """Yield the conditions that it evaluates."""
        for value in self.reads():
            if value.is_condition:
                yield from value.expressions()

    def fails_with(self) -> Codes:
        """Return the codes that it can fail with, besides those of its children."""
        return frozenset()

    def limits(self) -> Mapping[str, Value]:
        """Return the time limits among its values, by name."""
        return {}

    def missing_ends(self) -> tuple[str, ...]:
        """Return the ports of which it needs one to succeed, if none of them is set."""
        return ()

    def problems(self) -> Iterator[Finding]:
        """Yield what is wrong with it wherever it stands."""
        yield from ()

    def mock_outputs(self, outputs: Mapping[str, Symbol]) -> Mapping[str, Declaration] | None:
        """Return the outputs of its mock in mission tests; None if it cannot be mocked.

        Args:
            outputs: of the tree that it uses.
        """
        return None


@dataclass(frozen=True, slots=True)
class Event:
    """One entry of `events`.

    Attributes:
        hold: time for which `when` must be true, seconds.
        again: time after which it runs again while `when` stays true, seconds; None: never.
        step: node to run.
        then: resume | restart | abort.
    """

    name: str
    mark: Mark
    when: CheckedExpression
    hold: Value
    step: Step
    then: str
    again: Value | None = None


@dataclass(frozen=True, slots=True)
class Tree:
    """One entry of `trees` of the mission or of an included file.

    Attributes:
        doc: its description.
        events: alive while the tree is running.
    """

    name: str
    mark: Mark
    inputs: Mapping[str, Symbol]
    outputs: Mapping[str, Symbol]
    root: Step | None = None
    doc: str = ""
    events: tuple[Event, ...] = ()

    @property
    def roots(self) -> tuple[Step, ...]:
        """The root and the nodes of the events."""
        return (*((self.root,) if self.root else ()), *(event.step for event in self.events))


class TreeBuilder(Protocol):
    """Builds the nodes of a tree from the steps of a mission.

    Attributes:
        trees: the trees of the mission.
        frame: the blackboard keys of the mission.
    """

    execution: Execution
    trees: Mapping[str, Tree]
    frame: Frame

    def step(self, step: Step, frame: Frame) -> Node:
        """Return the node of a step, with its modifiers."""
        ...

    def events(self, events: Sequence[Event], root: Node, frame: Frame) -> Node:
        """Return the node of some events above a root; the root without events."""
        ...

    def stand_in(self, step: Step) -> RobotBehaviour | None:
        """Return the mock of a node in mission tests; None keeps the node."""
        ...

    def record(self, node: Node, kind: str, mark: Mark) -> Node:
        """Record a node for drawings and the event log, and return it."""
        ...

    def refuse(self, mark: Mark, sentence: str) -> None:
        """Report a node that cannot be built, once for its place in the file."""
        ...
