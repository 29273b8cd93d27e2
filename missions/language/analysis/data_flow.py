"""Data flow analysis: order of writes and reads, recursion, size, name hiding."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields

from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, Role, Scope, Symbol
from missions.language.model import (
    AssignmentList,
    Composite,
    Constant,
    Event,
    ExpressionValue,
    FollowWaypoints,
    ForEach,
    Leaf,
    ListValue,
    Reference,
    Step,
    Template,
    Tree,
    Use,
    Value,
)
from stack.documents import Findings, Mark

MAX_STEPS = 10_000
"""Nodes of a mission with every used tree expanded."""

MAX_LEVELS = 100
"""Depth of a mission with every used tree expanded; modifiers count as levels."""

Written = dict[Symbol, None]


def children_of(step: Step) -> tuple[Step, ...]:
    """Return the direct children of a step, recoveries last; a used tree is not expanded."""
    below: tuple[Step, ...] = ()
    if isinstance(step, Composite):
        below = step.children
    elif isinstance(step, ForEach):
        below = (step.child,)
    recover = step.modifiers.recover
    return below + (recover.recoveries if recover else ())


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
    sizes = _Sizes(trees, findings)
    total = sum(sizes.of(root, (), 0).nodes for root in roots)
    if total > MAX_STEPS:
        sentence = f"the mission has {total} nodes with all trees expanded; at most {MAX_STEPS}"
        findings.error("E126", roots[0].mark, sentence)
    order = list(sizes.order)
    for name, tree in trees.items():
        if name not in sizes.known and tree.root:
            sizes.of(tree.root, (name,), 0)
    return order


@dataclass(frozen=True, slots=True)
class _Size:
    """Nodes of a step with its trees expanded, and levels that it is high, modifiers included."""

    nodes: int
    levels: int


class _Sizes:
    """Sizes of steps; each tree is measured once. Reports recursive and too deep ones."""

    def __init__(self, trees: Mapping[str, Tree], findings: Findings) -> None:
        self.trees, self.findings = trees, findings
        self.order: list[str] = []
        self.known: dict[str, _Size] = {}
        self._is_too_deep = False

    def of(self, step: Step, path: tuple[str, ...], above: int) -> _Size:
        """Measure a step inside the trees of `path`, with so many levels above it."""
        own = _levels(step)
        if self._is_deep(step, above + own):
            return _Size(1, own)
        below = [self.of(child, path, above + own) for child in children_of(step)]
        if isinstance(step, Use):
            below.append(self._tree(step, path, above + own))
        return _Size(
            1 + sum(size.nodes for size in below),
            own + max((size.levels for size in below), default=0),
        )

    def _tree(self, use: Use, path: tuple[str, ...], above: int) -> _Size:
        name = use.tree
        if name in path:
            chain = " > ".join((*path[path.index(name) :], name))
            self.findings.error("E125", use.mark, f"the tree uses itself: {chain}")
            return _Size(0, 0)
        if name not in self.order:
            self.order.append(name)
        if name not in self.known:
            body = self.trees[name].root
            self.known[name] = self.of(body, (*path, name), above) if body else _Size(0, 0)
        self._is_deep(use, above + self.known[name].levels)
        return self.known[name]

    def _is_deep(self, step: Step, levels: int) -> bool:
        if levels > MAX_LEVELS and not self._is_too_deep:
            self._is_too_deep = True
            sentence = (
                f"nodes are nested more than {MAX_LEVELS} levels deep with all trees expanded"
            )
            hint = "each composite, `use` and modifier is a level; use fewer trees in each other"
            self.findings.error("E126", step.mark, sentence, hint)
        return levels > MAX_LEVELS


def _levels(step: Step) -> int:
    """Levels of a step without its children: itself and its modifiers."""
    modifiers = step.modifiers
    return 1 + sum(
        getattr(modifiers, item.name) not in (None, item.default) for item in fields(modifiers)
    )


class OrderCheck:
    """Walks the tree in the order of its first tick; reports reads of keys without a value.

    `written` collects the keys that may have been written so far. After an expression has tested a
    key with `is set`, reads of this key are not reported.
    """

    def __init__(self, trees: Mapping[str, Tree], findings: Findings) -> None:
        self.trees, self.findings = trees, findings

    def mission(self, root: Step, events: Sequence[Event]) -> None:
        """Check the mission and its events; an event can run at any time, after any write."""
        by_events: Written = {}
        for event in events:
            by_events.update(self.writes(event.step))
        everything = {**by_events, **self.writes(root)}
        self.step(root, by_events)
        for event in events:
            written = dict(everything)
            self.expression(event.when, event.mark, written)
            self.value(event.hold, event.mark, written)
            self.step(event.step, written)

    def step(self, step: Step, written: Written) -> None:
        """Check a step with its modifiers."""
        modifiers = step.modifiers
        for condition in (modifiers.when, modifiers.while_):
            self.expression(condition, step.mark, written)
        attempts = modifiers.retry.attempts if modifiers.retry else None
        for value in (modifiers.repeat, modifiers.timeout, modifiers.every, attempts):
            self.value(value, step.mark, written)
        self.body(step, written)
        if modifiers.recover:
            self.expression(modifiers.recover.unless, step.mark, written)
            for recovery in modifiers.recover.recoveries:
                self.step(recovery, written)

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
            self.step(tree.root, inside)
        for name, symbol in tree.outputs.items():
            if inside.pop(symbol, symbol) is None and name in step.outputs:
                inside[step.outputs[name]] = None
        written.update(inside)

    def writes(self, step: Step) -> Written:
        """Return every key that a step may write."""
        found: Written = {}
        if isinstance(step, Leaf | Use | FollowWaypoints):
            found.update(dict.fromkeys(step.outputs.values()))
        if isinstance(step, Leaf):
            for value in step.ports.values():
                if isinstance(value, AssignmentList):
                    found.update((symbol, None) for symbol, _ in value.assignments)
        root = self.trees[step.tree].root if isinstance(step, Use) else None
        for child in (*children_of(step), *((root,) if root else ())):
            found.update(self.writes(child))
        return found

    def value(self, value: Value | None, mark: Mark, written: Written) -> None:
        """Check the reads of a port value, and record the writes of `set`."""
        if isinstance(value, Reference):
            self.read(value.symbol, mark, written)
        elif isinstance(value, ListValue):
            for item in value.items:
                self.value(item, mark, written)
        elif isinstance(value, ExpressionValue):
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


def moves(step: Step, trees: Mapping[str, Tree]) -> bool:
    """Return whether a step, with the trees it uses, may move the robot."""
    if isinstance(step, Leaf):
        return step.behaviour.uses_wheels
    if isinstance(step, Use):
        root = trees[step.tree].root
        if root is not None and moves(root, trees):
            return True
    return any(moves(child, trees) for child in children_of(step))


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
