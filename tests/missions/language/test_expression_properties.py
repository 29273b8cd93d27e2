"""Random expressions against Python's arithmetic, and random texts against the parser."""

import operator
import sys
from math import isfinite
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviours.testing import ScriptedRobot
from missions.language import expressions
from missions.language.expressions.expression import NameContext, check_expression
from missions.language.expressions.scope import Role, Scope, Symbol
from missions.language.expressions.texts import pieces
from missions.language.expressions.tokens import MAX_LENGTH, ExpressionError
from missions.language.expressions.value_types import ANYTHING, INT, NUMBER, ValueType
from missions.language.reading.port_expressions import mentions_a_name
from missions.trees.context import Execution
from missions.trees.slots import Frame, Slot
from stack.documents import Mark
from stack.errors import EvaluationError

MARK = Mark("test")
VALUES = {"n": 7, "big": 2**62, "x": 0.25, "list": [3, -1, 4]}
TYPES = {"n": INT, "big": INT, "x": NUMBER, "list": ValueType(list, item=INT)}
SYMBOLS = {name: Symbol(name, Role.KEY, TYPES[name], MARK, VALUES[name]) for name in VALUES}
AROUND = NameContext(Scope((SYMBOLS,)), knows_error=True, knows_attempt=True)


class DeclaredFailure(Exception):
    """The failure that an expression must have, by its code."""


def bounded(number):
    if isinstance(number, int):
        if not -(2**63) <= number < 2**63:
            raise DeclaredFailure("OVERFLOW")
    elif not isfinite(number):
        raise DeclaredFailure("OVERFLOW")
    return number


def python_result(word, left, right):
    if word in ("/", "%") and right == 0:
        raise DeclaredFailure("DIVISION_BY_ZERO")
    calls = {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv,
             "%": operator.mod}  # fmt: skip
    return bounded(calls[word](left, right))


def item(index):
    if not 0 <= index < 3:
        raise DeclaredFailure("OUT_OF_RANGE")
    return VALUES["list"][index]


UNITS = [(0, 0), (1, 0), (0, 1), (1, -1)]
"""Exponents of m and s."""


@st.composite
def numbers(draw, depth, unit):
    """The source of a number with this unit, and a function that computes it in Python."""
    if depth == 0:
        return draw(literals(unit))
    kind = draw(st.sampled_from(["sum", "sum", "product", "quotient", "minus", "call", "item"]))
    if kind == "product":
        part = draw(st.sampled_from(UNITS))
        rest = (unit[0] - part[0], unit[1] - part[1])
        return joined("*", draw(numbers(depth - 1, part)), draw(numbers(depth - 1, rest)))
    if kind == "quotient":
        part = draw(st.sampled_from(UNITS))
        whole = (unit[0] + part[0], unit[1] + part[1])
        return joined("/", draw(numbers(depth - 1, whole)), draw(numbers(depth - 1, part)))
    source, value = draw(numbers(depth - 1, unit))
    if kind == "minus":
        return f"-({source})", lambda: bounded(-value())
    if kind == "item":
        index = draw(st.integers(-1, 3))
        return f"({source} + $list[{index}])", (
            lambda: python_result("+", value(), item(index))
        )  # fmt: skip
    other, second = draw(numbers(depth - 1, unit))
    if kind == "call":
        word, call = draw(st.sampled_from([("min", min), ("max", max)]))
        return f"abs({word}({source}, {other}))", lambda: bounded(abs(call(value(), second())))
    word = draw(st.sampled_from("+-%"))
    return joined(word, (source, value), (other, second))


@st.composite
def literals(draw, unit):
    named = st.sampled_from(["$n", "$n", "$x", "$big"]).map(lambda word: (word, VALUES[word[1:]]))
    whole = st.integers(0, 2**63 - 1).map(lambda number: (str(number), number))
    small = st.integers(-9, 9).map(lambda number: (f"({number})", number))
    broken = st.sampled_from(["0.5", "1e300", "2.75", "1.5"]).map(lambda word: (word, float(word)))
    source, value = draw(st.one_of(named, small, small, small, small, broken, whole))
    for exponent, base in zip(unit, "ms", strict=True):
        word = "*" if exponent > 0 else "/"
        source += f" {word} 1 {base}" * abs(exponent)
        value = value * 1.0 if exponent else value
    return f"({source})", lambda: value


def joined(word, left, right):
    return f"({left[0]} {word} {right[0]})", lambda: python_result(word, left[1](), right[1]())


@st.composite
def conditions(draw):
    unit = draw(st.sampled_from(UNITS))
    left, right = draw(numbers(2, unit)), draw(numbers(1, unit))
    word = draw(st.sampled_from(["<", "<=", ">", ">=", "==", "!="]))
    calls = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
             "==": operator.eq, "!=": operator.ne}  # fmt: skip
    return f"{left[0]} {word} {right[0]}", lambda: calls[word](left[1](), right[1]())


def outcome_of(source):
    """The value of an expression, or the code of its failure; a literal 0 divides no number."""
    checked, problems = check_expression(source, AROUND, ANYTHING)
    if problems:
        assert {problem.code for problem in problems} == {"E157"}
        return "never a value"
    execution = Execution()
    execution.robot = ScriptedRobot()
    readers = {symbol: Slot(symbol).read for symbol in SYMBOLS.values()}
    bound = checked.bind(Frame(execution, readers, {}))
    try:
        return bound()
    except EvaluationError as error:
        return str(error.code)


def expected_outcome(value):
    try:
        return value()
    except DeclaredFailure as failure:
        return str(failure)


def agree(source, value):
    if len(source) > MAX_LENGTH:
        return
    found, expected = outcome_of(source), expected_outcome(value)
    if found == "never a value":
        assert isinstance(expected, str)  # a failure in Python too
    else:
        assert found == expected


@settings(deadline=None, max_examples=80)
@given(number=st.sampled_from(UNITS).flatmap(lambda unit: numbers(3, unit)))
def test_numbers_are_those_of_python(number):
    agree(*number)


@settings(deadline=None, max_examples=40)
@given(condition=conditions())
def test_conditions_are_those_of_python(condition):
    agree(*condition)


@settings(deadline=None, max_examples=30)
@given(number=st.sampled_from(UNITS[1:]).flatmap(lambda unit: numbers(2, unit)))
def test_no_number_with_a_unit_is_compared_with_another_unit(number):
    checked, problems = check_expression(f"{number[0][: MAX_LENGTH - 9]} < 1 kg", AROUND)
    assert checked is None
    assert problems


FOLDER = str(Path(expressions.__file__).parent)
STEPS_PER_CHARACTER = 40
"""Most calls in the package; a list of 250 empty lists needs 26 per character."""


def steps_of(source):
    """How many functions of the package are called to parse and check a text."""
    steps = 0

    def count(frame, event, _):
        nonlocal steps
        steps += event == "call" and frame.f_code.co_filename.startswith(FOLDER)

    sys.setprofile(count)
    try:
        checked, problems = check_expression(source, AROUND, ANYTHING)
    finally:
        sys.setprofile(None)
    assert (checked is None) == bool(problems)
    return steps


WORDS = st.sampled_from(
    ["$n", "$list", "1", "2 m", "20 %", "%", "+", "-", "*", "/", "(", ")", "[", "]", ",", ".x", "<",
     "not", "and", "is", "set", "min(", "pose(", "append(", "pose", "'a'", "$", "1e999", "{", "é"]
)  # fmt: skip
TEXTS = st.text(max_size=80) | st.lists(WORDS, max_size=60).map(" ".join)


@settings(deadline=None, max_examples=80)
@given(source=TEXTS)
def test_any_text_is_parsed_in_bounded_steps(source):
    assert steps_of(source) <= STEPS_PER_CHARACTER * (len(source) + 10)
    mentions_a_name(source)
    try:
        list(pieces(source))
    except ExpressionError as error:
        assert 0 <= error.at <= len(source)


@pytest.mark.parametrize(
    "source",
    ["[" * 500, "[" + "[]," * 160 + "1]", "(" * 39 + "1" + ")" * 39, "1+" * 249 + "1",
     "min(" * 125, "$list" + "[0" * 200, "1 " * 250, "'" * 499, " " * 499 + "1", "9" * 500],
)  # fmt: skip
def test_long_texts_are_parsed_in_bounded_steps(source):
    assert steps_of(source) <= STEPS_PER_CHARACTER * (len(source) + 10)
