"""Values of a running tree: blackboard keys, loop variables, inputs of used trees.

Slots belong to one tree. There is no process-wide blackboard, so trees are independent.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from missions.language.expressions.arithmetic import (
    exact_float,
    limited,
    limited_list,
    limited_text,
)
from missions.language.expressions.robot_values import EvaluationContext
from missions.language.expressions.scope import UNSET, NotSet, Symbol
from missions.language.expressions.texts import formatter
from missions.language.values import Computed, Constant, ListValue, Reference, Template, Value
from missions.trees.attempts import Attempts
from missions.trees.context import Execution, HandledFailure
from missions.trees.latch import Latch, Read
from stack.errors import EvaluationError, ParameterError
from stack.parameters import Declaration
from stack.types import FailureCode

Write = Callable[[Any], None]


class Slot:
    """One value with its type."""

    __slots__ = ("keep", "kind", "name", "type", "value")

    def __init__(self, symbol: Symbol) -> None:
        self.name, self.value, self.type = symbol.name, symbol.value, symbol.type
        self.kind, self.keep = symbol.type.of, symbol.keep

    def read(self) -> Any:
        """Return the value.

        Raises:
            NotSet: nothing has written it yet.
        """
        if self.value is UNSET:
            raise NotSet(f"${self.name} is read, but nothing has written it yet")
        return self.value

    def write(self, value: Any) -> None:
        """Store a value; None clears the slot.

        Raises:
            ParameterError: the value has another type, e.g. because of a wrong port annotation.
            EvaluationError: the value is too large.
        """
        if value is None:
            self.value = UNSET
            return
        if self.kind is float and type(value) is int:
            value = exact_float(value)
        elif type(value) is int or type(value) is float:
            limited(value)
        elif isinstance(value, str):
            limited_text(value)
        elif isinstance(value, list):
            value = self._list(value)
        if not isinstance(value, self.kind):
            wanted = self.kind.__name__
            raise ParameterError(self.name, f"${self.name} has the type {wanted}, got {value!r}")
        self.value = value

    def _list(self, items: list[Any]) -> list[Any]:
        item = self.type.item
        if item is not None and item.of is float:
            items = [exact_float(each) if type(each) is int else each for each in items]
        return limited_list(items)


def _formatted(read: Read, form: Callable[[Any], str]) -> str:
    return form(read())


@dataclass(frozen=True, slots=True)
class Frame:
    """Bindings of names at one position of a tree: a language.expressions.Bindings.

    Attributes:
        readers: functions that read symbols, for all that are not constant.
        writers: functions that write symbols, for all that are writable.
        attempts: of the innermost retry or recover.
        handled: failure that the innermost recover or fallback deals with.
        always_set: `out` symbols that are bound to keys with an initial value.
    """

    execution: Execution
    readers: dict[Symbol, Read]
    writers: dict[Symbol, Write]
    attempts: Attempts | None = None
    handled: HandledFailure | None = None
    always_set: frozenset[Symbol] = frozenset()

    @property
    def context(self) -> EvaluationContext:
        """The robot, and the failure being handled."""
        return self.execution

    def attempt(self) -> int:
        """Return the current attempt."""
        return self.attempts.number if self.attempts else 1

    def error(self) -> str:
        """Return the code of the failure being dealt with; "" without one."""
        return self.handled.read() if self.handled else ""

    def can_be_unset(self, symbol: Symbol) -> bool:
        """Return whether a key or `out` may be without a value."""
        return symbol.value is UNSET and symbol not in self.always_set

    def handling(self, handled: HandledFailure) -> Frame:
        """Return this frame inside a node that deals with a failure."""
        return replace(self, handled=handled)

    def reader(self, symbol: Symbol) -> Read:
        """Return a function that reads a symbol."""
        if symbol.is_constant:
            value = symbol.value
            return lambda: value
        return self.readers[symbol]

    def value(self, value: Value) -> Read:
        """Return a function that reads the value of a port."""
        if isinstance(value, Constant):
            constant = value.value
            return lambda: constant
        if isinstance(value, Reference):
            return self.reader(value.symbol)
        if isinstance(value, ListValue):
            return self._list(value)
        if isinstance(value, Computed):
            return Latch(self._computed(value))
        if isinstance(value, Template):
            return self._text(value)
        raise TypeError(f"not a plain value: {value!r}")

    def _list(self, value: ListValue) -> Read:
        items = [self.value(item) for item in value.items]

        def read() -> list[Any]:
            return [item.compute() if isinstance(item, Latch) else item() for item in items]

        return Latch(read) if any(isinstance(item, Latch) for item in items) else read

    def _computed(self, value: Computed) -> Read:
        read, kind = value.expression.bind(self), value.type
        if kind.of is not float or value.expression.type.of is float:
            return read

        def number() -> Any:
            found = read()
            return exact_float(found) if type(found) is int else found

        return number

    def _text(self, template: Template) -> Read:
        """Return a function that fills the placeholders of a text."""
        parts: list[Callable[[], str]] = []
        for part in template.parts:
            if isinstance(part, str):
                parts.append(partial(str, part))
            else:
                form = formatter(part.type, self.execution.describe)
                parts.append(partial(_formatted, part.bind(self), form))
        return lambda: limited_text("".join([part() for part in parts]))

    def checked(self, value: Value, declared: Declaration) -> Read:
        """As `value`; a value that can change is checked against the declared range when read."""
        read = self.value(value)
        limits = (declared.at_least, declared.at_most, declared.above)
        if isinstance(value, Constant) or (not declared.one_of and limits == (None, None, None)):
            return read

        latched = isinstance(read, Latch)
        plain = read.compute if isinstance(read, Latch) else read

        def checked() -> Any:
            found = plain()
            try:
                declared.check(found)
            except ParameterError as error:
                raise EvaluationError(FailureCode.OUT_OF_RANGE, str(error)) from None
            return found

        return Latch(checked) if latched else checked

    def with_slot(self, symbol: Symbol) -> tuple[Frame, Slot]:
        """Return this frame with one more symbol, and the slot of that symbol."""
        slot = Slot(symbol)
        readers, writers = {**self.readers, symbol: slot.read}, {**self.writers, symbol: slot.write}
        return replace(self, readers=readers, writers=writers), slot
