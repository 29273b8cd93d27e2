"""Possible values of expressions: interval arithmetic over their terms.

An argument or a blackboard key can have any value of its type; a robot value is within its range.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf

from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.language.expressions.terms import (
    Binary,
    Distance,
    Literal,
    Named,
    Reference,
    Term,
    Unary,
)

TruthValues = frozenset[bool]
EITHER: TruthValues = frozenset((True, False))
_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


@dataclass(frozen=True, slots=True)
class Interval:
    """Numbers from `least` to `most`; an open end is not included."""

    least: float = -inf
    most: float = inf
    open_least: bool = False
    open_most: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether it contains no number."""
        ends_open = self.open_least or self.open_most
        return self.least > self.most or (self.least == self.most and ends_open)

    def intersection(self, other: Interval) -> Interval:
        """Return the intersection."""
        low = max((self.least, self.open_least), (other.least, other.open_least))
        high = min((self.most, not self.open_most), (other.most, not other.open_most))
        return Interval(low[0], high[0], low[1], not high[1])


def truth_values(term: Term) -> TruthValues:
    """Return the possible values of a condition."""
    if isinstance(term, Literal):
        return frozenset((bool(term.value),))
    if isinstance(term, Unary) and term.word == "not":
        return frozenset(not value for value in truth_values(term.operand))
    if isinstance(term, Binary):
        if term.word in ("and", "or"):
            return _logical(term)
        if term.word in ("==", "!=", "<", "<=", ">", ">="):
            return _comparison(term)
    return EITHER


def numbers(term: Term) -> Interval:
    """Return the possible values of a numeric term."""
    if isinstance(term, Literal) and isinstance(term.value, int | float):
        return Interval(term.value, term.value)
    if isinstance(term, Named) and term.name in ROBOT_VALUES:
        known = ROBOT_VALUES[term.name]
        return Interval(known.least, known.most)
    if isinstance(term, Distance):
        return Interval(0.0, inf)
    if isinstance(term, Unary):
        inner = numbers(term.operand)
        return Interval(-inner.most, -inner.least)
    if isinstance(term, Binary) and term.word in ("+", "-"):
        left, right = numbers(term.left), numbers(term.right)
        if term.word == "+":
            return Interval(left.least + right.least, left.most + right.most)
        return Interval(left.least - right.most, left.most - right.least)
    return Interval()


def _logical(term: Binary) -> TruthValues:
    left, right = truth_values(term.left), truth_values(term.right)
    if term.word == "or":
        return frozenset(a or b for a in left for b in right)
    found = frozenset(a and b for a in left for b in right)
    return found - {True} if _contradicts_itself(term) else found


def _comparison(term: Binary) -> TruthValues:
    if isinstance(term.left, Literal) and isinstance(term.right, Literal):
        return _of_literals(term.word, term.left, term.right)
    left, right = numbers(term.left), numbers(term.right)
    if term.word in (">", ">="):
        left, right = right, left
    if term.word in ("==", "!="):
        equal = frozenset((False,)) if left.intersection(right).is_empty else EITHER
        return equal if term.word == "==" else frozenset(not value for value in equal)
    if "=" in term.word:
        can, cannot = left.least <= right.most, left.most > right.least
    else:
        can, cannot = left.least < right.most, left.most >= right.least
    return frozenset(([True] if can else []) + ([False] if cannot else []))


def _of_literals(word: str, left: Literal, right: Literal) -> TruthValues:
    if word in ("==", "!="):
        return frozenset(((left.value == right.value) is (word == "=="),))
    low, high = (left, right) if "<" in word else (right, left)
    return frozenset((low.value <= high.value if "=" in word else low.value < high.value,))


def _contradicts_itself(term: Binary) -> bool:
    """Return whether the bounds of one value exclude each other: `$n > 3 and $n < 2`."""
    allowed: dict[str, Interval] = {}
    for part in _conjuncts(term):
        for key, interval in _bounds(part):
            allowed[key] = allowed.get(key, Interval()).intersection(interval)
    return any(interval.is_empty for interval in allowed.values())


def _conjuncts(term: Term) -> Iterator[Term]:
    if isinstance(term, Binary) and term.word == "and":
        yield from _conjuncts(term.left)
        yield from _conjuncts(term.right)
    else:
        yield term


def _bounds(term: Term) -> Iterator[tuple[str, Interval]]:
    """Yield the interval that a comparison with a number allows for the other operand."""
    if not isinstance(term, Binary) or term.word not in _MIRRORED:
        return
    for one, other, word in (
        (term.left, term.right, term.word), (term.right, term.left, _MIRRORED[term.word]),
    ):  # fmt: skip
        if not isinstance(one, Named | Reference) or not isinstance(other, Literal):
            continue
        if isinstance(other.value, bool | str):
            continue
        value, is_open = float(other.value), "=" not in word
        least = value if word in (">", ">=", "==") else -inf
        most = value if word in ("<", "<=", "==") else inf
        kind = "$" if isinstance(one, Reference) else ""
        yield f"{kind}{one.name}", Interval(least, most, is_open, is_open)
