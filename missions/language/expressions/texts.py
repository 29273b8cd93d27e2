"""Texts with placeholders: `say: visited ${visited} of 3, ${battery.charge} left`.

A placeholder `${…}` contains a name or an expression. `$${` is a literal `${`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import degrees
from typing import Any

from missions.language.expressions.compound_terms import TextTerm
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.scope import Scope, Symbol
from missions.language.expressions.shown import shown
from missions.language.expressions.terms import Literal, Term
from missions.language.expressions.tokens import ExpressionError
from missions.language.expressions.units import NO_UNIT
from missions.language.expressions.value_types import TEXT, ValueType
from stack.documents import Mark

OPEN, ESCAPED = "${", "$${"
_NAME = re.compile(r"[A-Za-z_]\w*")


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a text: plain text, or the source of an expression and its offset in the text."""

    text: str
    at: int = 0
    is_expression: bool = False


def has_placeholders(text: str) -> bool:
    """Return whether a text contains placeholders or an escaped `${`."""
    return OPEN in text


def pieces(text: str) -> Iterator[Piece]:
    """Split a text into its parts; empty plain ones are omitted.

    Raises:
        ExpressionError: a `${` is not closed.
    """
    plain, at = "", 0
    while (start := text.find(OPEN, at)) >= 0:
        if text[start - 1 : start + 2] == ESCAPED and start > at:
            plain += text[at : start - 1] + OPEN
            at = start + len(OPEN)
            continue
        if plain + text[at:start]:
            yield Piece(plain + text[at:start])
        end = _closing(text, start + len(OPEN))
        if end < 0:
            raise ExpressionError(
                start, "`${` is not closed", "add `}`; write `$${` for a literal `${`"
            )
        yield Piece(text[start + len(OPEN) : end], start + len(OPEN), is_expression=True)
        plain, at = "", end + 1
    if plain + text[at:]:
        yield Piece(plain + text[at:])


def _closing(text: str, at: int) -> int:
    """Return the offset of the next `}` outside quotes; -1 if there is none."""
    quote = ""
    for place in range(at, len(text)):
        sign = text[place]
        if quote:
            quote = "" if sign == quote else quote
        elif sign in "'\"":
            quote = sign
        elif sign == "}":
            return place
    return -1


def source_of(piece: Piece, scope: Scope) -> tuple[str, int]:
    """Return the expression of a piece and its shift: a single name needs no `$`."""
    word = piece.text.strip()
    if _NAME.fullmatch(word) and scope.lookup(word) is not None:
        return f"${word}", len(piece.text) - len(piece.text.lstrip()) - 1
    return piece.text, 0


def formatter(kind: ValueType, describe: Callable[[Any], str]) -> Callable[[Any], str]:
    """Return a function that formats a value: numbers with three digits and their unit.

    Args:
        kind: type of the expression.
        describe: formats values without a unit: places by name, poses, lists.
    """
    unit = "" if kind.unit == NO_UNIT else kind.unit

    def with_unit(value: Any) -> str:
        if unit in ("rad", "rad/s", "rad/s²"):
            return f"{shown(degrees(value))} {unit.replace('rad', 'deg')}"
        return f"{shown(float(value))} {unit}"

    return with_unit if unit else describe


def text_expression(
    parts: Sequence[str | CheckedExpression], text: str, mark: Mark
) -> CheckedExpression:
    """Return the expression of a text with placeholders, as a value of `set`."""
    terms: list[tuple[Term, ValueType]] = []
    read: dict[str, Symbol] = {}
    tested: dict[str, Symbol] = {}
    for part in parts:
        if isinstance(part, str):
            terms.append((Literal(0, part, TEXT), TEXT))
        else:
            terms.append((part.term, part.type))
            read.update(part.read)
            tested.update(part.tested)
    term = TextTerm(0, tuple(terms), formatter)
    return CheckedExpression(text, term, TEXT, read, tested, mark, may_fail=True, reads_robot=True)
