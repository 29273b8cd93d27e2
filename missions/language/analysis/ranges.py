"""Comparisons that are constant by the declared ranges of their two sides."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, inf, pi

from missions.language.analysis.intervals import Interval, Known, numbers, truth_values
from missions.language.expressions.compound_terms import Call
from missions.language.expressions.expression import CheckedExpression
from missions.language.expressions.robot_values import ROBOT_VALUES
from missions.language.expressions.scope import Role
from missions.language.expressions.terms import Binary, Literal, Named, Reference, Term, Unary
from missions.language.expressions.units import NO_UNIT
from missions.language.expressions.value_types import ANGLE, INT, SHARE, ValueType

FULL_TURN = 360
"""A bare number up to this one beside an angle is probably in degrees."""
COMPARISONS = ("<", "<=", ">", ">=", "==", "!=")


def ranges_of(condition: CheckedExpression) -> Known:
    """Return what an expression's arguments can be: the ends of `range`, the texts of `one_of`."""
    known: dict[str, Interval | frozenset[str]] = {}
    for name, symbol in condition.read.items():
        if symbol.role is not Role.ARGUMENT:
            continue
        if symbol.one_of:
            known[f"${name}"] = frozenset(symbol.one_of)
        elif symbol.limits != (-inf, inf):
            known[f"${name}"] = Interval(*symbol.limits)
    return known


def comparisons(term: Term) -> Iterator[Binary]:
    """Yield the comparisons in a condition."""
    if isinstance(term, Unary):
        yield from comparisons(term.operand)
    elif isinstance(term, Binary) and term.word in ("and", "or"):
        yield from comparisons(term.left)
        yield from comparisons(term.right)
    elif isinstance(term, Binary) and term.word in COMPARISONS:
        yield term


def constant_comparisons(condition: CheckedExpression) -> Iterator[tuple[Binary, bool]]:
    """Yield the comparisons that ranges make constant, with their value."""
    known = ranges_of(condition)
    for part in comparisons(condition.term):
        found = truth_values(part, known)
        if len(found) == 1:
            yield part, True in found


def range_hint(condition: CheckedExpression) -> str:
    """Return the range that makes a comparison constant, and the unit that is probably meant."""
    known = ranges_of(condition)
    for part, _ in constant_comparisons(condition):
        for one, other in ((part.left, part.right), (part.right, part.left)):
            named = one.arguments[0] if isinstance(one, Call) and one.name == "abs" else one
            hint = _hint(named, other, _type_of(named, condition), known)
            if hint:
                return hint
    return ""


def _type_of(term: Term, condition: CheckedExpression) -> ValueType | None:
    """Return the type of a name; None for any other term."""
    if isinstance(term, Named) and term.name in ROBOT_VALUES:
        return ROBOT_VALUES[term.name].type
    return condition.read[term.name].type if isinstance(term, Reference) else None


def _hint(one: Term, other: Term, kind: ValueType | None, known: Known) -> str:
    if kind is None:
        return ""
    name, texts = _plain(one), known.get(_plain(one))
    if isinstance(texts, frozenset):
        return f"{name} is one of {', '.join(sorted(texts))}"
    interval = numbers(one, known)
    if interval == Interval():
        return ""
    bounds = f"{name} is {_between(interval, kind)}"
    if isinstance(other, Literal) and not isinstance(other.value, str):
        if other.type == INT and kind == SHARE and 1 < other.value <= 100:
            return f"{bounds}: write {other.value} %"
        if not other.type.unit and kind == ANGLE and pi < abs(other.value) <= FULL_TURN:
            return f"{bounds}, and a number alone is in radians: write {other.value:g} deg"
    return bounds


def text_of_comparison(part: Binary) -> str:
    """Return a comparison of a name with a number, about as written; "" for another one."""
    left, right = _plain(part.left), _plain(part.right)
    return f"{left} {part.word} {right}" if left and right else ""


def _plain(term: Term) -> str:
    if isinstance(term, Named):
        return term.name
    if isinstance(term, Reference):
        return f"${term.name}"
    if isinstance(term, Literal) and isinstance(term.value, int | float):
        return _shown(term.value, term.type)
    return repr(term.value) if isinstance(term, Literal) else ""


def _between(interval: Interval, kind: ValueType) -> str:
    if kind == ANGLE:
        interval = Interval(degrees(interval.least), degrees(interval.most))
    unit = "deg" if kind == ANGLE else kind.unit.replace(NO_UNIT, "")
    least, most = (f"{end:g} {unit}".rstrip() for end in (interval.least, interval.most))
    if interval.most == inf:
        return f"at least {least}"
    return f"at most {most}" if interval.least == -inf else f"between {interval.least:g} and {most}"


def _shown(value: float, kind: ValueType) -> str:
    return f"{value:g} {kind.unit.replace(NO_UNIT, '')}".rstrip()
