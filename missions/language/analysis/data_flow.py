"""Data flow analysis: order of writes and reads, recursion, size, name hiding."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import wraps
from typing import Any, Protocol, TypeVar

from missions.language.expressions.scope import Scope, Symbol
from missions.language.step import Step, Tree
from missions.language.values import Constant, Reference
from stack.documents import Findings
from stack.parameters import values_of

MAX_STEPS = 10_000
"""Nodes of a mission with every used tree expanded."""

MAX_LEVELS = 100
"""Depth of a mission with every used tree expanded; modifiers count as levels."""

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
    recover, last = step.modifiers.recover, step.modifiers.finally_
    return (
        *step.children(), *(recover.recoveries if recover else ()), *((last,) if last else ())
    )  # fmt: skip


def steps_below(step: Step, trees: Mapping[str, Tree]) -> tuple[Step, ...]:
    """Return the children of a step, those of a used tree included."""
    return (*children_of(step), *(trees[step.uses].roots if step.uses else ()))


def steps_of(step: Step) -> Iterator[Step]:
    """Yield a step and everything below it, in the order of the file; trees are not expanded."""
    stack = [step]
    while stack:
        found = stack.pop()
        yield found
        stack += reversed(children_of(found))


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
        findings.add("E126", roots[0].mark, sentence)
    order = list(sizes.order)
    for name, tree in trees.items():
        if name not in sizes.known:
            for step in tree.roots:
                sizes.of(step, (name,), 0)
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
        self.order: dict[str, None] = {}
        self.known: dict[str, _Size] = {}
        self._is_too_deep = False

    def of(self, step: Step, path: tuple[str, ...], above: int) -> _Size:
        """Measure a step inside the trees of `path`, with so many levels above it."""
        own = _levels(step)
        if self._is_deep(step, above + own):
            return _Size(1, own)
        below = [self.of(child, path, above + own) for child in children_of(step)]
        if step.uses:
            below.append(self._tree(step, path, above + own))
        return _Size(
            1 + sum(size.nodes for size in below),
            own + max((size.levels for size in below), default=0),
        )

    def _tree(self, use: Step, path: tuple[str, ...], above: int) -> _Size:
        name = use.uses
        if name in path:
            chain = " > ".join((*path[path.index(name) :], name))
            self.findings.add("E125", use.mark, f"the tree uses itself: {chain}")
            return _Size(0, 0)
        self.order[name] = None
        if name not in self.known:
            sizes = [self.of(root, (*path, name), above) for root in self.trees[name].roots]
            self.known[name] = _Size(
                sum(size.nodes for size in sizes), max((size.levels for size in sizes), default=0)
            )
        self._is_deep(use, above + self.known[name].levels)
        return self.known[name]

    def _is_deep(self, step: Step, levels: int) -> bool:
        if levels > MAX_LEVELS and not self._is_too_deep:
            self._is_too_deep = True
            sentence = (
                f"nodes are nested more than {MAX_LEVELS} levels deep with all trees expanded"
            )
            hint = "each composite, `use` and modifier is a level; use fewer trees in each other"
            self.findings.add("E126", step.mark, sentence, hint)
        return levels > MAX_LEVELS


def _levels(step: Step) -> int:
    """Levels of a step without its children: itself and its modifiers."""
    values = values_of(step.modifiers)
    return 1 + sum(values[item.name] not in (None, item.default) for item in fields(step.modifiers))


def warn_of_other_meaning(use: Step, tree: Tree, scope: Scope, findings: Findings) -> None:
    """Report `in` and `out` names that hide another name of the mission.

    `dwell: $dwell` passes a name on. Both names then mean the same, which is not reported.
    """
    bound, results = dict(use.binds(tree.inputs)), use.results()
    for symbol in (*tree.inputs.values(), *tree.outputs.values()):
        hidden = scope.lookup(symbol.name)
        value = bound.get(symbol)
        same = results.get(symbol.name) is hidden
        if isinstance(value, Reference):
            same = value.symbol is hidden
        elif isinstance(value, Constant):
            equal = hidden is not None and hidden.is_constant and hidden.value == value.value
            same = value.text == f"${symbol.name}" or equal
        if hidden is not None and not same:
            sentence = f"the {symbol.role} {symbol.name!r} hides the {hidden.role}"
            findings.add("W101", symbol.mark, sentence, "use another name for it")
