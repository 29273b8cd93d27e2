"""Scopes of `$name`: loop variables, a tree's in and out, places, blackboard, arguments."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from math import inf
from typing import Any

from missions.language.expressions.value_types import ValueType
from stack.documents import Mark
from stack.errors import EvaluationError
from stack.parameters import did_you_mean, nearest
from stack.types import FailureCode


class Role(StrEnum):
    """The kind of a name."""

    PLACE = "place"
    ARGUMENT = "argument"
    KEY = "blackboard key"
    VARIABLE = "loop variable"
    INPUT = "`in` of the tree"
    OUTPUT = "`out` of the tree"


class _Unset:
    """Type of `UNSET`."""

    def __repr__(self) -> str:
        return "not set"


UNSET: Any = _Unset()
"""Value of a key that nothing has written yet."""


class NotSet(EvaluationError):
    """A blackboard key is read before it has a value."""

    def __init__(self, sentence: str) -> None:
        super().__init__(FailureCode.NOT_SET, sentence)


@dataclass(frozen=True, eq=False, slots=True)
class Symbol:
    """One declared name. Two symbols are equal only if they are the same declaration.

    Attributes:
        value: value of a place or argument; initial value of a key, or UNSET.
        one_of: the only texts that an argument may have; empty if any.
        limits: least and greatest value of an argument.
        doc: what a key is for; "" without `doc`.
        keep: whether the next run begins with the value of the last one; only of a key.
    """

    name: str
    role: Role
    type: ValueType
    mark: Mark
    value: Any = UNSET
    doc: str = ""
    one_of: tuple[str, ...] = ()
    keep: bool = False
    limits: tuple[float, float] = (-inf, inf)

    @property
    def is_constant(self) -> bool:
        """Whether its value is known before the mission runs."""
        return self.role in (Role.PLACE, Role.ARGUMENT)

    @property
    def is_writable(self) -> bool:
        """Whether a node may write it."""
        return self.role in (Role.KEY, Role.OUTPUT)


@dataclass(frozen=True, slots=True)
class Scope:
    """Layers of names, innermost first.

    Attributes:
        layers: name -> symbol.
        complete: False if the world cannot be read: a name that is not found may be a place of it.
    """

    layers: tuple[Mapping[str, Symbol], ...]
    complete: bool = True

    def lookup(self, name: str) -> Symbol | None:
        """Return the symbol of a name; None if there is none."""
        return next((layer[name] for layer in self.layers if name in layer), None)

    def inside(self, layer: Mapping[str, Symbol]) -> Scope:
        """Return the scope with one more layer in front."""
        return Scope((layer, *self.layers), self.complete)

    def names(self) -> list[str]:
        """Return every name in scope, for suggestions."""
        return [name for layer in self.layers for name in layer]

    def hint(self, name: str) -> str:
        """Return a hint for an unknown `$name`, with names as they are written: `$dock`."""
        if name in ("time", "battery", "robot", "localisation", "pose", "error", "attempt"):
            return f"values of the robot have no $: write `{name}`"
        close, names = self.likely(name), sorted(set(self.names()))
        if close:
            return close
        return f"available: {', '.join(f'${known}' for known in names)}" if names else ""

    def likely(self, name: str) -> str:
        """Return the hint with the most similar name; "" if none is similar."""
        close = nearest(name, sorted(set(self.names())))
        return "" if close is None else did_you_mean(f"${close}")

    def symbols(self) -> Iterator[Symbol]:
        """Yield every symbol, innermost layer first; hidden ones are included."""
        for layer in self.layers:
            yield from layer.values()
