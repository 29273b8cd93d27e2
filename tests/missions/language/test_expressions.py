"""The expression language: values, types, explanations; Python itself is the oracle."""

from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviours.testing import ScriptedRobot
from missions.language.expressions.expression import NameContext, check_expression
from missions.language.expressions.scope import UNSET, NotSet, Role, Scope, Symbol
from missions.language.expressions.value_types import (
    ANYTHING,
    BOOL,
    INT,
    NUMBER,
    POSE,
    TEXT,
    ValueType,
    type_of_annotation,
)
from missions.trees.context import Execution, HandledFailure
from missions.trees.slots import Frame, Slot
from stack.documents import Mark
from stack.types import Battery, Pose2D, Twist

MARK = Mark("test")
SYMBOLS = {
    symbol.name: symbol
    for symbol in (
        Symbol("dock", Role.PLACE, POSE, MARK, Pose2D(3.0, 4.0, pi)),
        Symbol("least", Role.ARGUMENT, NUMBER, MARK, 0.3),
        Symbol("n", Role.KEY, INT, MARK, 7),
        Symbol("m", Role.KEY, INT, MARK, 2),
        Symbol("word", Role.KEY, TEXT, MARK, "hm"),
        Symbol("photo", Role.KEY, TEXT, MARK, UNSET),
    )
}
AROUND = NameContext(Scope((SYMBOLS,)), knows_error=True, knows_attempt=True)


def bound(source, wanted=ANYTHING):
    checked, problems = check_expression(source, AROUND, wanted)
    assert problems == []
    execution = Execution()
    execution.robot = ScriptedRobot(
        time=65.0,
        battery=Battery(0.18),
        speed=Twist(-0.25, 0.5),
        pose=Pose2D(0.0, 0.0, pi / 2),
        covariance=np.diag([0.04, 0.01, 0.0]),  # the larger deviation is 0.2 m
    )
    handled = HandledFailure()
    handled.code = "LOST"
    keys = [symbol for symbol in SYMBOLS.values() if symbol.role is Role.KEY]
    readers = {symbol: Slot(symbol).read for symbol in keys}
    return checked, checked.bind(Frame(execution, readers, {}, handled=handled))


@pytest.mark.parametrize(
    ("source", "value"),
    [
        ("1 + 2 * 3", 7),
        ("(1 + 2) * 3", 9),
        ("8 / 2 / 2", 2.0),
        ("10 - 3 - 2", 5),
        ("-2 * -3", 6),
        ("- (2 + 3)", -5),
        ("30 cm + 1 m", 1.3),
        ("180 deg", pi),
        ("5 min", 300.0),
        ("20 %", 0.2),
        ("3.6 km/h", 1.0),
        ("1e3", 1000.0),
        (".5", 0.5),
        ("not false and true", True),
        ("true or false and false", True),
        ("not 1 > 2", True),
        ("battery.charge < $least", True),
        ("not battery.charging", True),
        ("robot.speed == 0.25 m/s", True),
        ("robot.turning", 0.5),
        ("localisation.health >= 1", True),
        ("localisation.deviation", 0.2),
        ("time > 1 min", True),
        ("pose.distance_to($dock)", 5.0),
        ("pose.heading > 89 deg", True),
        ("$dock.x", 3.0),
        ("$dock == $dock", True),
        ("pose != $dock", True),
        ("error == LOST", True),
        ("error != 'MY_CODE'", True),
        ("attempt", 1),
        ("$n is set", True),
        ("$photo is set", False),
        ("$photo is not set or $photo == 'a'", True),
        ("$photo is set and $photo == 'a'", False),
        ("$word == \"hm\"", True),
    ],
)  # fmt: skip
def test_values(source, value):
    assert bound(source)[1]() == pytest.approx(value)


@pytest.mark.parametrize(
    ("source", "kind"),
    [
        ("$n + 1", INT), ("$n / 2", NUMBER), ("$n + 1.0", NUMBER), ("$n > 3", BOOL),
        ("robot.speed * 2", ValueType(float, "m/s")), ("1 m / 2 s", ValueType(float, "m/s")),
        ("time + 1", ValueType(float, "s")), ("2 / 4 s", ValueType(float, "Hz")),
        ("error", TEXT), ("pose", POSE), ("$dock.heading", ValueType(float, "rad")),
    ],
)  # fmt: skip
def test_types(source, kind):
    assert bound(source)[0].type == kind


@pytest.mark.parametrize(
    ("source", "explained"),
    [
        ("battery.charge > $least", "battery.charge (0.18) > $least (0.3)"),
        ("not ($n  < 3)", "not ($n (7)  < 3)"),
        ("$photo is set", "$photo is set (not set)"),
        ("pose.distance_to($dock) < 1 m", "pose.distance_to($dock) (5) < 1 m"),
        ("error == LOST and battery.charging", "error (LOST) == LOST and battery.charging (false)"),
        ("$dock.x > 1", "$dock.x (3) > 1"),
    ],
)
def test_explanations_show_the_values_of_names(source, explained):
    assert bound(source)[1].explain() == explained


def test_what_is_read_and_what_is_only_tested():
    checked, _ = bound("$photo is set and $n > 3")
    assert (list(checked.read), list(checked.tested)) == (["n"], ["photo"])


def test_reading_an_unset_key_raises():
    with pytest.raises(NotSet, match=r"\$photo"):
        bound("$photo == 'a'")[1]()


NUMBERS = st.integers(0, 20).map(str) | st.sampled_from(["0.5", "2.5", "$n", "$m"])
SUMS = st.recursive(
    NUMBERS,
    lambda inner: (
        st.builds("({} {} {})".format, inner, st.sampled_from("+-*"), inner)
        | st.builds("{} {} {}".format, inner, st.sampled_from("+-*"), inner)
        | st.builds("-{}".format, inner)
    ),
    max_leaves=8,
)
COMPARISONS = st.builds(
    "{} {} {}".format, SUMS, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), SUMS
)
CONDITIONS = st.recursive(
    COMPARISONS,
    lambda inner: (
        st.builds("{} {} {}".format, inner, st.sampled_from(["and", "or"]), inner)
        | st.builds("not {}".format, inner)
        | st.builds("({})".format, inner)
    ),
    max_leaves=5,
)


@settings(deadline=None, max_examples=200)
@given(source=CONDITIONS)
def test_precedence_is_pythons(source):
    expected = eval(source.replace("$n", "7").replace("$m", "2"))
    assert bound(source)[1]() == expected


@pytest.mark.parametrize("first", ["<", "<=", ">", ">=", "==", "!="])
@pytest.mark.parametrize("second", ["<", "<=", ">", ">=", "==", "!="])
def test_comparisons_do_not_chain(first, second):
    checked, (problem,) = check_expression(f"$n {first} $m {second} 3", AROUND)
    assert checked is None
    assert "comparisons cannot be chained" in problem.sentence
    assert problem.at == len(f"$n {first} $m ")


@pytest.mark.parametrize(
    ("annotation", "unit", "expected"),
    [
        (float | None, "m", ValueType(float, "m")), (None | int, "", INT),
        (list[float] | None, "m", ValueType(list, item=ValueType(float, "m"))),
        (float | str, "m", ANYTHING), (Pose2D | str | None, "", ANYTHING),
    ],
)  # fmt: skip
def test_what_may_be_left_out_has_the_type_of_what_is_given(annotation, unit, expected):
    assert type_of_annotation(annotation, unit) == expected


@settings(deadline=None, max_examples=300)
@given(source=st.text(alphabet="$nm.()<>=!+-*/ 0123'\"andorticsby%é", max_size=40))
def test_any_text_is_an_expression_or_a_problem(source):
    checked, problems = check_expression(source, AROUND)
    assert (checked is None) == bool(problems)
    assert all(0 <= problem.at <= max(0, len(source)) for problem in problems)


@pytest.mark.parametrize("source", ["(" * 500, "not " * 400, "-" * 900 + "1", "1+" * 400 + "1"])
def test_depth_is_limited(source):
    checked, problems = check_expression(source, AROUND, ANYTHING)
    assert checked is not None or problems
