"""Values at the ports of nodes: known before the mission runs, or read while it runs."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any, ClassVar

from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import UNSET, Symbol
from missions.language.expressions.shown import shown
from missions.language.expressions.value_types import ValueType
from stack.documents import Mark


class Value(ABC):
    """The value of a port."""

    __slots__ = ()
    names_itself: ClassVar[bool] = False
    """Whether its text is clear without the name of its port."""
    is_condition: ClassVar[bool] = False
    """Whether a behaviour evaluates it when it needs it."""

    @abstractmethod
    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        """Yield what it reads, in order."""

    @property
    @abstractmethod
    def source(self) -> str:
        """The value as text in one line, as written in the mission file."""

    def writes(self) -> tuple[Symbol, ...]:
        """Return the symbols that it writes, after all that it reads."""
        return ()

    def reads_for_itself(self) -> set[Symbol]:
        """Return the symbols that it reads for their own new values only."""
        return set()

    def expressions(self) -> Iterator[CheckedExpression]:
        """Yield its expressions, in order."""
        return (item for item in self.reads() if isinstance(item, CheckedExpression))

    def symbols(self) -> Iterator[Symbol]:
        """Yield the symbols that it reads, or tests with `is set`."""
        for item in self.reads():
            yield from symbols_in(item) if isinstance(item, CheckedExpression) else (item,)

    def may_fail(self) -> bool:
        """Return whether it can be without a value when it is read."""
        return any(
            may_fail(item) if isinstance(item, CheckedExpression) else may_be_unset(item)
            for item in self.reads()
        )


@dataclass(frozen=True, slots=True)
class Constant(Value):
    """A value known before the mission runs.

    Attributes:
        text: the value as written.
        mark: its position; None for a default.
        items: positions of the items of a list.
    """

    value: Any
    text: str = ""
    mark: Mark | None = field(default=None, compare=False)
    items: tuple[Mark, ...] = field(default=(), compare=False)

    @property
    def is_written(self) -> bool:
        """Whether it is a literal at this position: neither a default nor a `$name`."""
        return self.mark is not None and not self.text.startswith("$")

    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        return iter(())

    @property
    def source(self) -> str:
        return self.text or shown(self.value)


@dataclass(frozen=True, slots=True)
class Reference(Value):
    """The current value of a symbol."""

    symbol: Symbol

    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        yield self.symbol

    @property
    def source(self) -> str:
        return f"${self.symbol.name}"


@dataclass(frozen=True, slots=True)
class ListValue(Value):
    """A list with references; evaluated when it is read."""

    items: tuple[Value, ...]

    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        for item in self.items:
            yield from item.reads()

    @property
    def source(self) -> str:
        return f"[{', '.join(item.source for item in self.items)}]"


@dataclass(frozen=True, slots=True)
class Template(Value):
    """A text with placeholders; evaluated when it is read. `text` is the text as written."""

    parts: tuple[str | CheckedExpression, ...]
    text: str

    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        return (part for part in self.parts if isinstance(part, CheckedExpression))

    @property
    def source(self) -> str:
        return self.text


@dataclass(frozen=True, slots=True)
class ExpressionValue(Value):
    """An expression that is passed to a behaviour."""

    names_itself = is_condition = True
    expression: CheckedExpression

    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        yield self.expression

    @property
    def source(self) -> str:
        return self.expression.source


@dataclass(frozen=True, slots=True)
class Computed(Value):
    """The value of an expression, computed when the node starts; `type` is that of the port."""

    expression: CheckedExpression
    type: ValueType

    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        yield self.expression

    @property
    def source(self) -> str:
        return self.expression.source


@dataclass(frozen=True, slots=True)
class AssignmentList(Value):
    """The assignments of `set`."""

    names_itself = True
    assignments: tuple[tuple[Symbol, CheckedExpression], ...]

    def reads(self) -> Iterator[Symbol | CheckedExpression]:
        return (expression for _, expression in self.assignments)

    def writes(self) -> tuple[Symbol, ...]:
        return tuple(symbol for symbol, _ in self.assignments)

    def reads_for_itself(self) -> set[Symbol]:
        pairs = self.assignments
        own = {symbol for symbol, expression in pairs if symbol in expression.read.values()}
        return own - {
            item for symbol, expression in pairs for item in expression.read.values()
            if item is not symbol
        }  # fmt: skip

    @property
    def source(self) -> str:
        return ", ".join(f"{symbol.name} = {item.source}" for symbol, item in self.assignments)


def symbols_in(expression: CheckedExpression) -> Iterator[Symbol]:
    """Yield the symbols that an expression reads, or tests with `is set`."""
    yield from expression.read.values()
    yield from expression.tested.values()


def may_fail(expression: CheckedExpression) -> bool:
    """Return whether the evaluation can fail: a key may be unset, or there is a division."""
    return expression.may_fail or any(map(may_be_unset, expression.read.values()))


def may_be_unset(symbol: Symbol) -> bool:
    """Return whether a symbol can be without a value."""
    return symbol.is_writable and symbol.value is UNSET
