"""Functions of expressions: `min(a, b)`, `distance(a, b)`, `append($list, x)`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import hypot, pi
from typing import Any

from missions.language.expressions.arithmetic import limited, limited_list
from missions.language.expressions.terms import Check, Literal, Term, Unary, common_number
from missions.language.expressions.value_types import (
    ANGLE,
    ANYTHING,
    BOOL,
    INT,
    LENGTH,
    POSE,
    TEXT,
    ValueType,
)
from stack.errors import EvaluationError
from stack.parameters import FARTHEST
from stack.types import FailureCode, Pose2D, wrap_angle

Arguments = Sequence[tuple[Term, ValueType]]
"""The arguments of a call with their types."""


@dataclass(frozen=True, slots=True)
class Function:
    """A function of the expression language.

    Attributes:
        signature: for people: `min(a, b, …)`.
        help: one sentence.
        result: type of the result, for people.
        least: least number of arguments.
        most: greatest number of arguments.
        check: returns the type of the result; records problems with the arguments.
        apply: computes the result.
    """

    signature: str
    help: str
    result: str
    least: int
    most: int
    check: Callable[[Check, Arguments], ValueType]
    apply: Callable[..., Any]


def _extreme(check: Check, arguments: Arguments) -> ValueType:
    (term, first), *others = arguments
    if not others and first.item is not None:
        if not first.item.is_number:
            sentence = f"the items must be numbers, got {first}"
            return check.problem("E152", term.at, sentence)
        return first.item
    if not others:
        return check.problem("E152", term.at, f"expected two numbers or a list, got {first}")
    found = first
    for term, kind in arguments:
        found = common_number(check, term.at, found, kind, "compare")
    return found


def _absolute(check: Check, arguments: Arguments) -> ValueType:
    ((term, kind),) = arguments
    if not kind.is_number:
        return check.problem("E152", term.at, f"abs needs a number, got {kind}")
    return kind


def _length(check: Check, arguments: Arguments) -> ValueType:
    ((term, kind),) = arguments
    if kind.item is None and kind not in (TEXT, ANYTHING):
        return check.problem("E152", term.at, f"length needs a list or a text, got {kind}")
    return INT


def _distance(check: Check, arguments: Arguments) -> ValueType:
    for term, kind in arguments:
        if not POSE.accepts(kind):
            check.problem("E152", term.at, f"distance needs poses, got {kind}")
    return LENGTH


def _pose(check: Check, arguments: Arguments) -> ValueType:
    names = (("x", LENGTH), ("y", LENGTH), ("heading", ANGLE))
    for (term, kind), (name, wanted) in zip(arguments, names, strict=False):
        if not wanted.accepts(kind):
            check.problem("E152", term.at, f"{name} of a pose must be {wanted}, got {kind}")
        elif name == "heading" and not kind.unit:
            _check_heading(check, term)
    return POSE


def _check_heading(check: Check, term: Term) -> None:
    """Report a bare number above a full turn, which is almost certainly in degrees."""
    inner = term.operand if isinstance(term, Unary) else term
    if isinstance(inner, Literal) and abs(inner.value) > 2.0 * pi + 1e-9:
        sentence = f"a heading of {inner.value:g} rad is more than a full turn"
        check.problem("E152", term.at, sentence, f"write {inner.value:g} deg")


def _appended(check: Check, arguments: Arguments) -> ValueType:
    (first, items), (second, item) = arguments
    if items == ANYTHING:
        return ValueType(list, item=ANYTHING)
    if items.item is None:
        return check.problem("E152", first.at, f"append needs a list first, got {items}")
    if items.item == ANYTHING:
        return ValueType(list, item=item)
    if not items.item.accepts(item):
        return check.problem("E152", second.at, f"cannot append {item} to a {items}")
    return items


def _contained(check: Check, arguments: Arguments) -> ValueType:
    (first, items), (second, item) = arguments
    if items == ANYTHING:
        return BOOL
    if items.item is None:
        return check.problem("E152", first.at, f"contains needs a list first, got {items}")
    if not (items.item.accepts(item) or item.accepts(items.item)):
        return check.problem("E152", second.at, f"a {items} cannot contain {item}")
    return BOOL


def _least(*values: Any) -> Any:
    return min(_values(values, "min"))


def _greatest(*values: Any) -> Any:
    return max(_values(values, "max"))


def _values(values: tuple[Any, ...], name: str) -> Sequence[Any]:
    if len(values) > 1:
        return values
    found: Sequence[Any] = values[0]
    if not found:
        raise EvaluationError(FailureCode.OUT_OF_RANGE, f"{name} of an empty list")
    return found


def _make_pose(x: float, y: float, heading: float = 0.0) -> Pose2D:
    if max(abs(x), abs(y)) > FARTHEST:
        sentence = f"({x:g}, {y:g}) m is farther than {FARTHEST:g} m from the origin"
        raise EvaluationError(FailureCode.OUT_OF_RANGE, sentence)
    return Pose2D(float(x), float(y), wrap_angle(float(heading)))


def _between(one: Pose2D, other: Pose2D) -> float:
    return limited(hypot(other.x - one.x, other.y - one.y))


FUNCTIONS: dict[str, Function] = {
    "abs": Function(
        "abs(a)", "absolute value", "that of `a`", 1, 1, _absolute, lambda a: limited(abs(a))
    ),
    "append": Function(
        "append(list, item)", "a new list with the item at its end", "that of the list", 2, 2,
        _appended, lambda items, item: limited_list([*items, item]),
    ),
    "contains": Function(
        "contains(list, item)", "whether an item of the list is equal to this one", "true or false",
        2, 2, _contained, lambda items, item: item in items,
    ),
    "distance": Function(
        "distance(a, b)", "straight-line distance between two poses", "number in m", 2, 2,
        _distance, _between,
    ),
    "length": Function(
        "length(a)", "number of items of a list, or of characters of a text", "whole number", 1, 1,
        _length, len,
    ),
    "max": Function(
        "max(a, b, …)", "the greatest of several numbers, or of a list", "that of the numbers",
        1, 100, _extreme, _greatest,
    ),
    "min": Function(
        "min(a, b, …)", "the least of several numbers, or of a list", "that of the numbers",
        1, 100, _extreme, _least,
    ),
    "pose": Function(
        "pose(x, y, heading)", "a pose in the map frame; the heading is optional", "Pose", 2, 3,
        _pose, _make_pose,
    ),
}  # fmt: skip
"""The functions by name; `pose.distance_to(place)` belongs to the robot values."""
