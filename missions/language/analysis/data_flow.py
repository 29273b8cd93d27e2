"""Data flow analysis: order of writes and reads, recursion, size, name hiding."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import wraps
from typing import Any, Protocol, TypeVar

from missions.language.expressions.scope import Scope, Symbol
from missions.language.model import (
    Composite,
    Constant,
    ForEach,
    Reference,
    Step,
    Tree,
    Use,
)
from stack.documents import Findings

MAX_STEPS = 10_000
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
