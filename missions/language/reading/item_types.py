"""Types of the items of a list whose item type is not declared, as in `for_each`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from missions.language.expressions.texts import has_placeholders
from missions.language.expressions.units import NO_UNIT
from missions.language.expressions.value_types import (
    ANYTHING,
    BOOL,
    INT,
    NUMBER,
    POSE,
    TEXT,
    ValueType,
    common_type,
)
from stack.documents import Node
from stack.errors import ParameterError
from stack.parameters import quantity_unit, read_quantity, units

Lookup = Callable[[Node], ValueType | None]
"""Returns the type of a `$name`; None for anything else."""


@dataclass(frozen=True, slots=True)
class Mismatch:
    """An item whose type does not fit those before it."""

    item: Node
    found: ValueType
    expected: ValueType


def item_type(items: list[Node], lookup: Lookup) -> ValueType | Mismatch:
    """Return the common type of the items; ANYTHING for an empty list.

    A word such as `3 s` is a quantity, but a text among other texts.
    """
    kinds = [_kind_of(item, lookup) for item in items]
    if TEXT in kinds:
        kinds = [
            TEXT if isinstance(item.value, str) and lookup(item) is None else kind
            for item, kind in zip(items, kinds, strict=True)
        ]
    common = ANYTHING
    for item, kind in zip(items, kinds, strict=True):
        fits = common_type(common, kind)
        if fits is None:
            return Mismatch(item, kind, common)
        common = fits
    return common


def _kind_of(item: Node, lookup: Lookup) -> ValueType:
    known = lookup(item)
    if known is not None:
        return known
    if item.kind != "scalar":
        return POSE if item.is_sequence else ANYTHING
    for kind, found in ((bool, BOOL), (int, INT), (float, NUMBER)):
        if isinstance(item.value, kind):
            return found
    if not isinstance(item.value, str):
        return ANYTHING
    return TEXT if item.quoted or has_placeholders(item.value) else _quantity(item.value)


def _quantity(text: str) -> ValueType:
    unit = quantity_unit(text)
    if unit is None:
        return TEXT
    dimension = units()[unit][0]
    try:
        read_quantity(text, dimension)
    except ParameterError:
        return TEXT
    return ValueType(float, dimension or NO_UNIT)
