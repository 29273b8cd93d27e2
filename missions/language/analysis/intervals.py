"""Possible values of expressions: interval arithmetic over their terms.

An argument or a blackboard key can have any value of its type; a robot value is within its range.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf, isnan
from operator import mul, truediv
from typing import Any

from missions.language.expressions.compound_terms import Call
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
from stack.types import FailureCode

TruthValues = frozenset[bool]
EITHER: TruthValues = frozenset((True, False))
Known = Mapping[str, Any]
NOTHING: Known = {}
_POSITION = re.compile(r"\b(at|end)=\d+,? ?")
_OPPOSITE = {"<": ">=", "<=": ">", ">": "<=", ">=": "<", "==": "!=", "!=": "=="}
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


def truth_values(term: Term, known: Known = NOTHING) -> TruthValues:
    """Return the possible values of a condition.

    Args:
        term: the condition.
        known: `$name` -> its value, interval or set of texts, and name of a robot value -> its
            interval, where known.
    """
    if isinstance(term, Literal):
        return frozenset((bool(term.value),))
    if isinstance(term, Reference) and isinstance(known.get(f"${term.name}"), bool):
        return frozenset((bool(known[f"${term.name}"]),))
    if isinstance(term, Unary) and term.word == "not":
        return frozenset(not value for value in truth_values(term.operand, known))
    if isinstance(term, Binary):
        if term.word in ("and", "or"):
            return _logical(term, known)
        if term.word in ("==", "!=", "<", "<=", ">", ">="):
            return _comparison(term, known)
    return EITHER


def numbers(term: Term, known: Known = NOTHING) -> Interval:
    """Return the possible values of a numeric term."""
    if isinstance(term, Literal) and isinstance(term.value, int | float):
        return Interval(term.value, term.value)
    if isinstance(term, Reference):
        return _interval(known.get(f"${term.name}"))
    if isinstance(term, Named) and term.name in ROBOT_VALUES:
        of_robot = ROBOT_VALUES[term.name]
        found = known.get(term.name)
        return Interval(of_robot.least, of_robot.most) if found is None else _interval(found)
    if isinstance(term, Distance):
        return Interval(0.0, inf)
    if isinstance(term, Unary):
        inner = numbers(term.operand, known)
        return Interval(-inner.most, -inner.least)
    if isinstance(term, Call):
        return _called(term, known)
    if isinstance(term, Binary) and term.word in ("+", "-", "*", "/"):
        return _computed(term.word, numbers(term.left, known), numbers(term.right, known))
    return Interval()


def _interval(value: Any) -> Interval:
    """Return the interval of a known number, or a known interval."""
    if isinstance(value, Interval):
        return value
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return Interval(value, value) if is_number else Interval()


def _computed(word: str, left: Interval, right: Interval) -> Interval:
    if word == "+":
        return Interval(left.least + right.least, left.most + right.most)
    if word == "-":
        return Interval(left.least - right.most, left.most - right.least)
    if word == "/" and right.least <= 0.0 <= right.most:
        return Interval()
    combine = mul if word == "*" else truediv
    pairs = [(one, other) for one in (left.least, left.most) for other in (right.least, right.most)]
    ends = [combine(one, other) for one, other in pairs]
    ends = [0.0 if isnan(end) else end for end in ends]  # 0 * inf, inf / inf: 0 is among the values
    return Interval(min(ends), max(ends))


def _called(term: Call, known: Known) -> Interval:
    """Return the possible values of a function of numbers."""
    if term.name in ("length", "distance"):
        return Interval(0.0, inf)
    if term.name == "abs":
        inner = numbers(term.arguments[0], known)
        least = max(inner.least, -inner.most, 0.0)
        return Interval(least, max(-inner.least, inner.most))
    if term.name not in ("min", "max") or len(term.arguments) < 2:
        return Interval()
    extreme = min if term.name == "min" else max
    parts = [numbers(item, known) for item in term.arguments]
    return Interval(extreme(p.least for p in parts), extreme(p.most for p in parts))


def _logical(term: Binary, known: Known) -> TruthValues:
    left, right = truth_values(term.left, known), truth_values(term.right, known)
    if term.word == "or":
        found = frozenset(a or b for a in left for b in right)
        return found - {False} if exclude_each_other(denied(term)) else found
    found = frozenset(a and b for a in left for b in right)
    return found - {True} if exclude_each_other(conjuncts(term)) else found


def _comparison(term: Binary, known: Known) -> TruthValues:
    if text_of(term.left) == text_of(term.right) and not isinstance(term.left, Literal):
        return frozenset(("=" in term.word and term.word != "!=",))
    if isinstance(term.left, Literal) and isinstance(term.right, Literal):
        return _of_literals(term.word, term.left, term.right)
    if term.word in ("==", "!=") and _cannot_equal(term, known):
        return frozenset((term.word == "!=",))
    left, right = numbers(term.left, known), numbers(term.right, known)
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


def _cannot_equal(term: Binary, known: Known) -> bool:
    """Return whether a name is compared with a text that it never has."""
    for one, other in ((term.left, term.right), (term.right, term.left)):
        texts = known.get(f"${one.name}") if isinstance(one, Reference) else None
        if isinstance(texts, frozenset) and isinstance(other, Literal):
            return other.value not in texts
    return False


def _of_literals(word: str, left: Literal, right: Literal) -> TruthValues:
    if word in ("==", "!="):
        return frozenset(((left.value == right.value) is (word == "=="),))
    low, high = (left, right) if "<" in word else (right, left)
    return frozenset((low.value <= high.value if "=" in word else low.value < high.value,))


def exclude_each_other(parts: Iterable[Term]) -> bool:
    """Return whether conditions cannot be true together: `$n > 3` and `$n < 2`, `a` and `not a`."""
    allowed: dict[str, Interval] = {}
    texts: dict[str, bool] = {}
    equal: dict[str, str] = {}
    for part in parts:
        for key, interval in _bounds(part):
            allowed[key] = allowed.get(key, Interval()).intersection(interval)
            if allowed[key].is_empty:
                return True
        wanted, inner = True, part
        while isinstance(inner, Unary) and inner.word == "not":
            wanted, inner = not wanted, inner.operand
        if texts.setdefault(text_of(inner), wanted) is not wanted:
            return True
        if isinstance(inner, Binary) and inner.word == "==" and wanted:
            for one, other in ((inner.left, inner.right), (inner.right, inner.left)):
                text = _word(other)
                if text is not None and equal.setdefault(text_of(one), text) != text:
                    return True
    return False


def _word(term: Term) -> str | None:
    """Return a constant text or failure code."""
    if isinstance(term, Named) and term.name in FailureCode.__members__:
        return term.name
    return term.value if isinstance(term, Literal) and isinstance(term.value, str) else None


def conjuncts(term: Term) -> Iterator[Term]:
    """Yield the conditions that must all be true."""
    if isinstance(term, Binary) and term.word == "and":
        yield from conjuncts(term.left)
        yield from conjuncts(term.right)
    elif isinstance(term, Unary) and term.word == "not":
        yield from denied(term.operand)
    else:
        yield term


def denied(term: Term) -> Iterator[Term]:
    """Yield the conditions that must all be true for this one to be false."""
    if isinstance(term, Binary) and term.word == "or":
        yield from denied(term.left)
        yield from denied(term.right)
    elif isinstance(term, Unary) and term.word == "not":
        yield from conjuncts(term.operand)
    elif isinstance(term, Binary) and term.word in _OPPOSITE:
        yield replace(term, word=_OPPOSITE[term.word])
    else:
        yield Unary(term.at, "not", term)


def text_of(term: Term) -> str:
    """Return a text that is equal for equal terms, wherever they stand."""
    return _POSITION.sub("", repr(term))


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
