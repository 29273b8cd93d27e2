"""Settings of a component in layers: a later one may choose another component."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from missions.language.model import Component
from stack.documents import Finding

Accepted = Callable[[str, str, Mapping[str, Any]], Mapping[str, Any]]
"""(kind, component, parameters) -> those of the parameters that the component accepts."""

CODE = "W114"


def layered(
    first: Component | None, then: Component, accepted: Accepted
) -> tuple[Component, Finding | None]:
    """Return the settings of a layer on top of others, and a warning if parameters are dropped.

    Another component keeps the parameters that it has too.
    """
    if first is None:
        return then, None
    values: Mapping[str, Any] = first.values
    if then.use is not None and then.use != first.use:
        values = accepted(then.kind, then.use, first.values)
    marks = {name: mark for name, mark in first.marks.items() if name in values}
    merged = replace(
        then, use=first.use if then.use is None else then.use,
        mark=first.mark if then.use is None else then.mark,
        values={**values, **then.values}, marks={**marks, **then.marks},
    )  # fmt: skip
    return merged, _dropped(first, then, values)


def _dropped(first: Component, then: Component, kept: Mapping[str, Any]) -> Finding | None:
    names = [name for name in first.values if name not in kept and name not in then.values]
    if not names:
        return None
    sentence = f"{then.kind}: no effect on {then.use}: {', '.join(names)}"
    return Finding(first.marks.get(names[0], first.mark), CODE, sentence)
