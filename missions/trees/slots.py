"""Where a running tree keeps values: blackboard keys, loop variables, what goes into a used tree.

Slots belong to one tree. There is no process-wide blackboard, so trees never disturb each other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from missions.language.expressions.robot_values import EvaluationContext
from missions.language.expressions.scope import UNSET, NotSet, Symbol
from missions.language.expressions.texts import formatter
from missions.language.model import Constant, ListValue, Reference, Template, Value
from missions.trees.attempts import Attempts
from missions.trees.context import Execution
from stack.errors import ParameterError
from stack.parameters import Declaration

Read = Callable[[], Any]
Write = Callable[[Any], None]


class Slot:
    """One value with its type."""

    __slots__ = ("kind", "name", "type", "value")

    def __init__(self, symbol: Symbol) -> None:
        self.name, self.value, self.type = symbol.name, symbol.value, symbol.type
        self.kind = symbol.type.of

    def read(self) -> Any:
        """The value.

        Raises:
            NotSet: nothing has written it yet.
        """
        if self.value is UNSET:
            raise NotSet(f"${self.name} is read, but nothing has written it yet")
        return self.value

    def write(self, value: Any) -> None:
        """Keep a value; None clears the slot.

        Raises:
            ParameterError: a value of another type, as a behaviour with wrong annotations may give.
        """
        if value is None:
            self.value = UNSET
            return
        if self.kind is float and type(value) is int:
            value = float(value)
        if not isinstance(value, self.kind):
            wanted = self.kind.__name__
            raise ParameterError(self.name, f"${self.name} holds a {wanted}, got {value!r}")
        self.value = value


def _written(read: Read, form: Callable[[Any], str]) -> str:
    return form(read())


@dataclass(frozen=True, slots=True)
class Frame:
    """What names stand for in one place of a tree; satisfies language.expressions.Bindings.

    Attributes:
        readers: for every symbol that is not a constant.
        writers: for every symbol that may be written.
        attempts: of the nearest retry or recover.
        skipped_fails: a skipped node counts as a failure, because a fallback stands around it.
    """

    execution: Execution
    readers: dict[Symbol, Read]
    writers: dict[Symbol, Write]
    attempts: Attempts | None = None
    skipped_fails: bool = False

    @property
    def context(self) -> EvaluationContext:
        """The robot, and the failure being dealt with."""
        return self.execution

    def attempt(self) -> int:
        """The attempt under way."""
        return self.attempts.number if self.attempts else 1

    def reader(self, symbol: Symbol) -> Read:
        """A function that reads a symbol."""
        if symbol.is_constant:
            value = symbol.value
            return lambda: value
        return self.readers[symbol]

    def value(self, value: Value) -> Read:
        """A function that reads what stands at a port."""
        if isinstance(value, Constant):
            constant = value.value
            return lambda: constant
        if isinstance(value, Reference):
            return self.reader(value.symbol)
        if isinstance(value, ListValue):
            items = [self.value(item) for item in value.items]
            return lambda: [item() for item in items]
        if isinstance(value, Template):
            return self._text(value)
        raise TypeError(f"not a plain value: {value!r}")

    def _text(self, template: Template) -> Read:
        """A function that puts a text together."""
        parts: list[Callable[[], str]] = []
        for part in template.parts:
            if isinstance(part, str):
                parts.append(partial(str, part))
            else:
                written = formatter(part.type, self.execution.describe)
                parts.append(partial(_written, part.bind(self), written))
        return lambda: "".join([part() for part in parts])

    def checked(self, value: Value, declared: Declaration) -> Read:
        """As `value`; one that may change is held against the declared range at each reading."""
        read = self.value(value)
        limits = (declared.at_least, declared.at_most, declared.above)
        if isinstance(value, Constant) or (not declared.one_of and limits == (None, None, None)):
            return read

        def checked() -> Any:
            found = read()
            declared.check(found)
            return found

        return checked

    def with_slot(self, symbol: Symbol) -> tuple[Frame, Slot]:
        """This frame with one more symbol, and where that is kept."""
        slot = Slot(symbol)
        readers, writers = {**self.readers, symbol: slot.read}, {**self.writers, symbol: slot.write}
        return replace(self, readers=readers, writers=writers), slot
