"""Text of steps and values in drawings and rows, as written in the mission file."""

from __future__ import annotations

from collections.abc import Mapping

from missions.language.expressions.scope import Symbol
from missions.language.expressions.shown import shown
from missions.language.model import (
    AssignmentList,
    Composite,
    Computed,
    Constant,
    ExpressionValue,
    FollowWaypoints,
    ForEach,
    Leaf,
    ListValue,
    Reference,
    Step,
    Switch,
    Template,
    Unset,
    Use,
    Value,
)


def value_text(value: Value) -> str:
    """Return a value as text in one line."""
    if isinstance(value, Constant):
        return value.text or shown(value.value)
    if isinstance(value, Reference):
        return f"${value.symbol.name}"
    if isinstance(value, ListValue):
        return f"[{', '.join(value_text(item) for item in value.items)}]"
    if isinstance(value, ExpressionValue | Computed):
        return value.expression.source
    if isinstance(value, Template):
        return value.text
    return ", ".join(f"{symbol.name} = {item.source}" for symbol, item in value.assignments)


def detail_of(step: Step) -> str:
    """Return the ports and outputs of a node as text in one line."""
    if isinstance(step, FollowWaypoints):
        return ", ".join([value_text(step.items), *_targets(step.outputs)])
    if isinstance(step, ForEach):
        return f"{step.variable.name} in {value_text(step.items)}"
    if isinstance(step, Composite):
        return f"{step.needed} of {len(step.children)}" if step.kind == "parallel" else ""
    if isinstance(step, Switch):
        return step.value.source
    if isinstance(step, Unset):
        return ", ".join(f"${symbol.name}" for symbol in step.targets)
    if not isinstance(step, Leaf | Use):
        return ""
    ports = step.ports if isinstance(step, Leaf) else step.inputs
    parts = [
        value_text(value)
        if isinstance(value, ExpressionValue | AssignmentList)
        else f"{name} {value_text(value)}"
        for name, value in ports.items()
    ]
    return ", ".join([*parts, *_targets(step.outputs)])


def _targets(outputs: Mapping[str, Symbol]) -> list[str]:
    """Return the targets of outputs; internal variables are omitted."""
    return [f"{name} -> ${symbol.name}" for name, symbol in outputs.items() if symbol.is_writable]


def names_of(step: Step) -> tuple[str, ...]:
    """Return the names of a node: its own name, and its behaviour or tree."""
    kind = step.tree if isinstance(step, Use) else ""
    kind = step.kind if isinstance(step, Leaf | Unset) else kind
    return tuple(dict.fromkeys(name for name in (step.name, kind) if name))
