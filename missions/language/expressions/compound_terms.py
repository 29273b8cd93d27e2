"""Terms with parts: calls of functions, items of lists, lists, and texts with placeholders."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from missions.language.expressions.arithmetic import item_at, limited_list, limited_text
from missions.language.expressions.functions import FUNCTIONS
from missions.language.expressions.terms import Check, Evaluate, Literal, Names, ShownTerm, Term
from missions.language.expressions.value_types import (
    ANYTHING,
    INT,
    TEXT,
    ValueType,
    common_type,
)


@dataclass(frozen=True, slots=True)
class Call(Term):
    """`min(a, b)`: a call of one of `FUNCTIONS`."""

    name: str
    arguments: tuple[Term, ...]

    def check(self, check: Check) -> ValueType:
        function = FUNCTIONS[self.name]
        check.may_fail = True
        kinds = [(term, term.check(check)) for term in self.arguments]
        if not function.least <= len(kinds) <= function.most:
            number = f"{function.least}"
            if function.most != function.least:
                number = f"{function.least} to {function.most}"
            sentence = f"{self.name} takes {number} arguments, got {len(kinds)}"
            return check.problem("E155", self.at, sentence, f"write {function.signature}")
        return function.check(check, kinds)

    def bind(self, names: Names) -> Evaluate:
        apply = FUNCTIONS[self.name].apply
        values = [term.bind(names) for term in self.arguments]
        return lambda: apply(*[value() for value in values])

    def parts(self) -> tuple[Term, ...]:
        return self.arguments


@dataclass(frozen=True, slots=True)
class Index(ShownTerm):
    """`$list[0]`: an item of a list."""

    items: Term
    index: Term

    def check(self, check: Check) -> ValueType:
        items, index = self.items.check(check), self.index.check(check)
        check.may_fail = True
        if index not in (INT, ANYTHING):
            check.problem("E152", self.index.at, f"an index is a whole number, got {index}")
        if items == ANYTHING:
            return ANYTHING
        if items.item is None:
            return check.problem("E152", self.at, f"only a list has items, got {items}")
        return items.item

    def bind(self, names: Names) -> Evaluate:
        items, index = self.items.bind(names), self.index.bind(names)
        return lambda: item_at(items(), index())

    def parts(self) -> tuple[Term, ...]:
        return self.items, self.index

    def named(self) -> Iterator[tuple[int, Term]]:
        yield from self.index.named()
        yield self.end, self


@dataclass(frozen=True, slots=True)
class ListTerm(Term):
    """`[$a, $b]`."""

    items: tuple[Term, ...]

    def check(self, check: Check) -> ValueType:
        found: ValueType | None = None
        for term in self.items:
            kind = term.check(check)
            common = kind if found is None else common_type(found, kind)
            if common is None:
                sentence = f"the items of a list have one type, got {found} and {kind}"
                return check.problem("E152", term.at, sentence)
            found = common
        return ValueType(list, item=found or ANYTHING)

    def bind(self, names: Names) -> Evaluate:
        values = [term.bind(names) for term in self.items]
        return lambda: limited_list([value() for value in values])

    def parts(self) -> tuple[Term, ...]:
        return self.items


@dataclass(frozen=True, slots=True)
class TextTerm(Term):
    """A text with placeholders as a value of `set`.

    Attributes:
        pieces: plain texts as literals, and the terms of the placeholders with their types.
        formatter: returns a function that formats values of a type.
    """

    pieces: tuple[tuple[Term, ValueType], ...]
    formatter: Callable[[ValueType, Callable[[Any], str]], Callable[[Any], str]]

    def check(self, check: Check) -> ValueType:
        check.may_fail = True
        for term, _ in self.pieces:
            term.check(check)
        return TEXT

    def bind(self, names: Names) -> Evaluate:
        describe = names.bindings.context.describe
        made: list[Callable[[], str]] = []
        for term, kind in self.pieces:
            form = str if isinstance(term, Literal) else self.formatter(kind, describe)
            made.append(partial(_formatted, term.bind(names), form))
        return lambda: limited_text("".join([part() for part in made]))

    def parts(self) -> tuple[Term, ...]:
        return tuple(term for term, _ in self.pieces)

    def named(self) -> Iterator[tuple[int, Term]]:
        return iter(())


def _formatted(read: Evaluate, form: Callable[[Any], str]) -> str:
    return form(read())
