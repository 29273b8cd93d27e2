"""What an expression can come to, whatever the robot does: interval arithmetic over its terms.

Arguments and blackboard keys may be anything of their type; a robot value lies in its own range.
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

Truths = frozenset[bool]
EITHER: Truths = frozenset((True, False))
_MIRRORED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


@dataclass(frozen=True, slots=True)
class Interval:
    """Numbers from `least` to `most`; an open end is not one of them."""

    least: float = -inf
    most: float = inf
    open_least: bool = False
    open_most: bool = False

    @property
    def is_empty(self) -> bool:
        """Whether there is no such number."""
        ends_open = self.open_least or self.open_most
        return self.least > self.most or (self.least == self.most and ends_open)

    def meet(self, other: Interval) -> Interval:
        """The numbers in both."""
        low = max((self.least, self.open_least), (other.least, other.open_least))
        high = min((self.most, not self.open_most), (other.most, not other.open_most))
        return Interval(low[0], high[0], low[1], not high[1])


def truths(term: Term) -> Truths:
    """The outcomes that a condition can have."""
    if isinstance(term, Literal):
        return frozenset((bool(term.value),))
    if isinstance(term, Unary) and term.word == "not":
        return frozenset(not value for value in truths(term.operand))
    if isinstance(term, Binary):
        if term.word in ("and", "or"):
            return _joined(term)
        if term.word in ("==", "!=", "<", "<=", ">", ">="):
            return _compared(term)
    return EITHER


def numbers(term: Term) -> Interval:
    """The values that a number can have."""
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


def _joined(term: Binary) -> Truths:
    left, right = truths(term.left), truths(term.right)
    if term.word == "or":
        return frozenset(a or b for a in left for b in right)
    found = frozenset(a and b for a in left for b in right)
    return found - {True} if _contradicts_itself(term) else found


def _compared(term: Binary) -> Truths:
    if isinstance(term.left, Literal) and isinstance(term.right, Literal):
        return _of_literals(term.word, term.left, term.right)
    left, right = numbers(term.left), numbers(term.right)
    if term.word in (">", ">="):
        left, right = right, left
    if term.word in ("==", "!="):
        equal = frozenset((False,)) if left.meet(right).is_empty else EITHER
        return equal if term.word == "==" else frozenset(not value for value in equal)
    if "=" in term.word:
        can, cannot = left.least <= right.most, left.most > right.least
    else:
        can, cannot = left.least < right.most, left.most >= right.least
    return frozenset(([True] if can else []) + ([False] if cannot else []))


def _of_literals(word: str, left: Literal, right: Literal) -> Truths:
    if word in ("==", "!="):
        return frozenset(((left.value == right.value) is (word == "=="),))
    low, high = (left, right) if "<" in word else (right, left)
    return frozenset((low.value <= high.value if "=" in word else low.value < high.value,))


def _contradicts_itself(term: Binary) -> bool:
    """Whether one value would have to lie in two places, as in `$n > 3 and $n < 2`."""
    allowed: dict[str, Interval] = {}
    for part in _conjuncts(term):
        for key, interval in _demanded(part):
            allowed[key] = allowed.get(key, Interval()).meet(interval)
    return any(interval.is_empty for interval in allowed.values())


def _conjuncts(term: Term) -> Iterator[Term]:
    if isinstance(term, Binary) and term.word == "and":
        yield from _conjuncts(term.left)
        yield from _conjuncts(term.right)
    else:
        yield term


def _demanded(term: Term) -> Iterator[tuple[str, Interval]]:
    """What a comparison with a number asks of the named value on its other side."""
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
