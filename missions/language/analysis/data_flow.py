"""Data flow analysis: order of writes and reads, recursion, size, name hiding."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import wraps
from typing import Any, Protocol, TypeVar

from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, Role, Scope, Symbol
from missions.language.model import (
    AssignmentList,
    Composite,
    Computed,
    Constant,
    Event,
    ExpressionValue,
    FollowWaypoints,
    ForEach,
    Leaf,
    ListValue,
    Reference,
    Step,
    Switch,
    Template,
    Tree,
    Use,
    Value,
)
from stack.documents import Findings, Mark

MAX_STEPS = 3000
"""Nodes of a mission with every used tree expanded."""
Written = dict[Symbol, None]


class StepAnalysis(Protocol):
    """An analysis with a memory for `once_per_step`: (method, id of the step) -> its result."""

    memory: dict[tuple[str, int], Any]


A = TypeVar("A", bound=StepAnalysis)
R = TypeVar("R")


def once_per_step(method: Callable[[A, Step], R]) -> Callable[[A, Step], R]:
    """Memoise a method by its step: a tree is analysed once, not once per `use`.

    The steps must live as long as the analysis, and the results must not be changed.
    """

    @wraps(method)
    def remembered(analysis: A, step: Step) -> R:
        key = method.__name__, id(step)
        if key not in analysis.memory:
            analysis.memory[key] = method(analysis, step)
        found: R = analysis.memory[key]
        return found

    return remembered


def children_of(step: Step) -> tuple[Step, ...]:
    """Return the children of a step, with recoveries and `finally`, but not a used tree."""
    below: tuple[Step, ...] = ()
    if isinstance(step, Composite):
        below = step.children
    elif isinstance(step, ForEach):
        below = (step.child,)
    elif isinstance(step, Switch):
        below = step.children
    recover, last = step.modifiers.recover, step.modifiers.finally_
    return below + (recover.recoveries if recover else ()) + ((last,) if last else ())


def uses_of(step: Step) -> Iterator[Use]:
    """Yield every `use` in a step, in order."""
    if isinstance(step, Use):
        yield step
    for child in children_of(step):
        yield from uses_of(child)


def check_recursion(
    trees: Mapping[str, Tree], roots: Sequence[Step], findings: Findings
) -> list[str]:
    """Report trees that use themselves and missions that are too large.

    Returns:
        The names of the used trees, in the order of their first use.
    """
    order: dict[str, None] = {}
    sizes: dict[str, int] = {}

    def size(step: Step, path: tuple[str, ...]) -> int:
        total = 1 + sum(size(child, path) for child in children_of(step))
        return total + (tree_size(step, path) if isinstance(step, Use) else 0)

    def tree_size(use: Use, path: tuple[str, ...]) -> int:
        name = use.tree
        if name in path:
            chain = " > ".join((*path[path.index(name) :], name))
            findings.error("E125", use.mark, f"the tree uses itself: {chain}")
            return 0
        order[name] = None
        if name not in sizes:
            sizes[name] = sum(size(step, (*path, name)) for step in trees[name].roots)
        return sizes[name]

    total = sum(size(root, ()) for root in roots)
    if total > MAX_STEPS:
        sentence = f"the mission has {total} nodes with all trees expanded; at most {MAX_STEPS}"
        findings.error("E126", roots[0].mark, sentence)
    for name, tree in trees.items():
        if name not in sizes:
            for step in tree.roots:
                size(step, (name,))
    return list(order)


class OrderCheck:
    """Walks the tree in the order of its first tick; reports reads of keys without a value.

    `written` collects the keys that may have been written so far. After an expression has tested a
    key with `is set`, reads of this key are not reported.
    """

    def __init__(self, trees: Mapping[str, Tree], findings: Findings) -> None:
        self.trees, self.findings = trees, findings
        self.memory: dict[tuple[str, int], Any] = {}

    def mission(self, root: Step, events: Sequence[Event]) -> None:
        """Check the mission and its events; an event can run at any time, after any write."""
        self._below_events(root, events, {})

    def _below_events(self, root: Step, events: Sequence[Event], written: Written) -> None:
        """Check a node with the events above it; an event can run at any time."""
        for event in events:
            written.update(self.writes(event.step))
        everything = {**written, **self.writes(root)} if events else {}
        self.step(root, written)
        for event in events:
            found = dict(everything)
            self.expression(event.when, event.mark, found)
            for value in (event.hold, event.again):
                self.value(value, event.mark, found)
            self.step(event.step, found)

    def step(self, step: Step, written: Written) -> None:
        """Check a step with its modifiers."""
        modifiers = step.modifiers
        for condition in (modifiers.when, modifiers.while_):
            self.expression(condition, step.mark, written)
        attempts = modifiers.retry.attempts if modifiers.retry else None
        for value in (modifiers.repeat, modifiers.timeout, modifiers.every, attempts):
            self.value(value, step.mark, written)
        self.body(step, written)
        self.expression(modifiers.until, step.mark, written)
        if modifiers.recover:
            self.expression(modifiers.recover.unless, step.mark, written)
            for recovery in modifiers.recover.recoveries:
                self.step(recovery, written)
        if modifiers.finally_:
            self.step(modifiers.finally_, written)

    def body(self, step: Step, written: Written) -> None:
        """Check a step without its modifiers."""
        if isinstance(step, Leaf):
            for value in step.ports.values():
                self.value(value, step.mark, written)
            written.update(dict.fromkeys(step.outputs.values()))
        elif isinstance(step, Use):
            self.use(step, written)
        elif isinstance(step, ForEach):
            self.value(step.items, step.mark, written)
            if isinstance(step, FollowWaypoints):
                written.update(dict.fromkeys(step.outputs.values()))
            self.step(step.child, written)
        elif isinstance(step, Composite):
            self.composite(step, written)
        elif isinstance(step, Switch):
            self.expression(step.value, step.mark, written)
            for child in step.children:
                self.step(child, written)

    def composite(self, step: Composite, written: Written) -> None:
        """Check the children in order; in a parallel each may read what any other writes."""
        if step.kind == "parallel":
            for child in step.children:
                written.update(self.writes(child))
        for child in step.children:
            self.step(child, written)

    def use(self, step: Use, written: Written) -> None:
        """Check a used tree in place of the `use`; its outputs are the keys they are bound to."""
        for value in step.inputs.values():
            self.value(value, step.mark, written)
        tree = self.trees[step.tree]
        inside = dict(written)
        for name, symbol in tree.outputs.items():
            target = step.outputs.get(name)
            inside.pop(symbol, None)
            if target is not None and _has_value(target, written):
                inside[symbol] = None
        if tree.root:
            self._below_events(tree.root, tree.events, inside)
        for name, symbol in tree.outputs.items():
            if inside.pop(symbol, symbol) is None and name in step.outputs:
                inside[step.outputs[name]] = None
        written.update(inside)

    @once_per_step
    def writes(self, step: Step) -> Written:
        """Return every key that a step may write."""
        found: Written = {}
        if isinstance(step, Leaf | Use | FollowWaypoints):
            found.update(dict.fromkeys(step.outputs.values()))
        if isinstance(step, Leaf):
            for value in step.ports.values():
                if isinstance(value, AssignmentList):
                    found.update((symbol, None) for symbol, _ in value.assignments)
        used = self.trees[step.tree].roots if isinstance(step, Use) else ()
        for child in (*children_of(step), *used):
            found.update(self.writes(child))
        return found

    def value(self, value: Value | None, mark: Mark, written: Written) -> None:
        """Check the reads of a port value, and record the writes of `set`."""
        if isinstance(value, Reference):
            self.read(value.symbol, mark, written)
        elif isinstance(value, ListValue):
            for item in value.items:
                self.value(item, mark, written)
        elif isinstance(value, ExpressionValue | Computed):
            self.expression(value.expression, mark, written)
        elif isinstance(value, Template):
            for expression in value.expressions:
                self.expression(expression, mark, written)
        elif isinstance(value, AssignmentList):
            for symbol, expression in value.assignments:
                self.expression(expression, mark, written)
                written[symbol] = None

    def expression(
        self, expression: CheckedExpression | None, mark: Mark, written: Written
    ) -> None:
        """Check the reads of an expression; a key tested with `is set` needs no value."""
        if expression is None:
            return
        written.update(dict.fromkeys(expression.tested.values()))
        for symbol in expression.read.values():
            self.read(symbol, mark, written)

    def read(self, symbol: Symbol, mark: Mark, written: Written) -> None:
        """Check the read of a symbol."""
        if not _has_value(symbol, written):
            sentence = f"${symbol.name} is read here, but nothing can have written it before"
            hint = "give it an initial value, or test `is set` first"
            self.findings.error("E143", mark, sentence, hint)


def _has_value(symbol: Symbol, written: Written) -> bool:
    if symbol.role is Role.KEY:
        return symbol.value is not UNSET or symbol in written
    return symbol.role is not Role.OUTPUT or symbol in written


def warn_of_other_meaning(use: Use, tree: Tree, scope: Scope, findings: Findings) -> None:
    """Report `in` and `out` names that hide another name of the mission.

    `dwell: $dwell` passes a name on. Both names then mean the same, which is not reported.
    """
    for symbol in (*tree.inputs.values(), *tree.outputs.values()):
        hidden = scope.lookup(symbol.name)
        value = use.inputs.get(symbol.name)
        same = use.outputs.get(symbol.name) is hidden
        if isinstance(value, Reference):
            same = value.symbol is hidden
        elif isinstance(value, Constant):
            equal = hidden is not None and hidden.is_constant and hidden.value == value.value
            same = value.text == f"${symbol.name}" or equal
        if hidden is not None and not same:
            sentence = f"the {symbol.role} {symbol.name!r} hides the {hidden.role}"
            findings.warning("W101", symbol.mark, sentence, "use another name for it")
