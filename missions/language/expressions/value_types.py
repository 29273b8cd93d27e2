"""Types of values in mission files, and their compatibility."""

from __future__ import annotations

import re
import types
import typing
from dataclasses import dataclass
from typing import Any

from missions.language.expressions.units import NO_UNIT
from stack.parameters import Declaration, suggestion, type_name
from stack.types import Assignments, Expression, Path, Pose2D


@dataclass(frozen=True, slots=True)
class ValueType:
    """A type with its unit.

    Attributes:
        of: the Python class; `object` is any type, `list` has an `item`.
        unit: SI unit of a float; "" for a plain number, which is compatible with every unit; "1"
            for a number without a unit, such as a share.
        item: type of the items of a list.
    """

    of: Any
    unit: str = ""
    item: ValueType | None = None

    def __str__(self) -> str:
        if self.of is object:
            return "anything"
        if self.unit == NO_UNIT:
            return "number without unit"
        return type_name(self.annotation, self.unit if self.item is None else self.item.unit)

    @property
    def annotation(self) -> Any:
        """The Python annotation, as in port declarations."""
        if self.item:
            return list[self.item.annotation]  # type: ignore[name-defined]
        return Any if self.of is object else self.of

    @property
    def is_number(self) -> bool:
        """Whether it is a number; `anything` counts as one."""
        return self.of in (int, float, object)

    @property
    def is_storable(self) -> bool:
        """Whether a value can be written to a file: all but paths to drive along."""
        return self.item.is_storable if self.item else self.of is not Path

    def accepts(self, other: ValueType) -> bool:
        """Return whether a value of the other type can be used as this type."""
        if object in (self.of, other.of):
            return True
        if self.item and other.item:
            return self.item.accepts(other.item)
        if not self.agrees_on_unit(other):
            return False
        if self.of is float:
            return other.of in (int, float)
        return bool(self.of is other.of or (self.of is not int and issubclass(other.of, self.of)))

    def agrees_on_unit(self, other: ValueType) -> bool:
        """Return whether the units agree; a plain number agrees with every unit."""
        return not (self.unit and other.unit) or self.unit == other.unit

    def declaration(self, name: str, **limits: Any) -> Declaration:
        """Return a declaration of this type, for reading literals."""
        unit = self.item.unit if self.item else self.unit
        unit = "" if unit == NO_UNIT else unit
        return Declaration(name, self.annotation, unit=unit, **limits)


ANYTHING = ValueType(object)
BOOL, INT, NUMBER, TEXT = ValueType(bool), ValueType(int), ValueType(float), ValueType(str)
SHARE, LENGTH, ANGLE = ValueType(float, NO_UNIT), ValueType(float, "m"), ValueType(float, "rad")
POSE, DURATION = ValueType(Pose2D), ValueType(float, "s")


def common_type(one: ValueType, other: ValueType) -> ValueType | None:
    """Return the type of list items of both types; None if they cannot be in one list.

    Whole numbers become numbers, and plain numbers have the unit of the others.
    """
    if object in (one.of, other.of):
        return other if one.of is object else one
    if one.item and other.item:
        item = common_type(one.item, other.item)
        return item and ValueType(list, item=item)
    if one.is_number and other.is_number:
        if not one.agrees_on_unit(other):
            return None
        return INT if one.of is other.of is int else ValueType(float, one.unit or other.unit)
    return one if one == other else None


EXPRESSION, ASSIGNMENTS = ValueType(Expression), ValueType(Assignments)

NAMED: dict[str, ValueType] = {
    "bool": BOOL,
    "int": INT,
    "float": NUMBER,
    "text": TEXT,
    "path": TEXT,
    "duration": DURATION,
    "length": LENGTH,
    "angle": ANGLE,
    "speed": ValueType(float, "m/s"),
    "angular_speed": ValueType(float, "rad/s"),
    "acceleration": ValueType(float, "m/s²"),
    "Pose": POSE,
    "Path": ValueType(Path),
}
"""Type names in mission files; each can follow `list of`."""

_LIST = re.compile(r"list\s+of\s+(.+)")


def named_type(text: str) -> ValueType | str:
    """Return the type with this name; a suggestion (str) if there is none."""
    found = _LIST.fullmatch(text.strip())
    if found:
        item = named_type(found[1])
        return item if isinstance(item, str) else ValueType(list, item=item)
    return NAMED.get(text.strip()) or suggestion(text, NAMED)


def type_of_annotation(kind: Any, unit: str = "") -> ValueType:
    """Return the type of a Python annotation; `X | None` is X, an unknown one is anything."""
    origin = typing.get_origin(kind)
    if origin in (typing.Union, types.UnionType):
        arms = [arm for arm in typing.get_args(kind) if arm is not type(None)]
        return type_of_annotation(arms[0], unit) if len(arms) == 1 else ANYTHING
    if origin in (list, tuple):
        inner = typing.get_args(kind)
        return ValueType(list, item=type_of_annotation(inner[0], unit) if inner else ANYTHING)
    if kind in (list, tuple):
        return ValueType(list, item=ANYTHING)
    if kind is Any or not isinstance(kind, type):
        return ANYTHING
    return ValueType(kind, unit if kind is float else "")


def type_of(declared: Declaration) -> ValueType:
    """Return the type of a declared port."""
    return type_of_annotation(declared.type, declared.unit)


def type_word(found: ValueType) -> str:
    """Return the word with which files declare a type: `duration`, `list of Pose`."""
    if found.item is not None:
        return f"list of {type_word(found.item)}"
    return next((word for word, known in NAMED.items() if known == found), "float")
