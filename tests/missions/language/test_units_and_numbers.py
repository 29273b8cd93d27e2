"""Units of products and quotients, and numbers that do not fit into 64 bits."""

import pytest

from missions.language.expressions.expression import NameContext, check_expression
from missions.language.expressions.scope import Role, Scope, Symbol
from missions.language.expressions.units import product, quotient
from missions.language.expressions.value_types import ANYTHING, INT, NUMBER, ValueType
from stack.documents import Mark
from stack.errors import InputError
from tests.missions.mission_fakes import ran, read_text

MARK = Mark("test")
AROUND = NameContext(Scope(({
    "n": Symbol("n", Role.KEY, INT, MARK, 7),
    "plain": Symbol("plain", Role.KEY, NUMBER, MARK, 2.5),
},)))  # fmt: skip


@pytest.mark.parametrize(
    ("left", "right", "times", "by"),
    [
        ("m", "s", "m·s", "m/s"),
        ("m/s", "s", "m", "m/s²"),
        ("rad/s", "s", "rad", "rad/s²"),
        ("m", "m", "m²", "1"),
        ("", "s", "s", "Hz"),
        ("", "", "", ""),
        ("1", "m", "m", "1/m"),
        ("m/s²", "kg", "N", "m/(kg·s²)"),
        ("N", "m/s", "W", "kg/s"),
        ("m·s", "s", "m·s²", "m"),
        ("m/(kg·s)", "s", "m/kg", "m/(kg·s²)"),
        ("Wh", "W", "kg·m²·Wh/s³", "Wh·s³/(kg·m²)"),
    ],
)
def test_units_of_products_and_quotients(left, right, times, by):
    assert (product(left, right), quotient(left, right)) == (times, by)


def kind_of(source):
    checked, problems = check_expression(source, AROUND, ANYTHING)
    return checked.type if checked else [problem.sentence for problem in problems]


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("$n * 2 s", ValueType(float, "s")),
        ("$plain * 2 s", ValueType(float, "s")),
        ("20 % * 3 m", ValueType(float, "m")),
        ("battery.charge * 2", ValueType(float, "1")),
        ("pose.x / 2 m", ValueType(float, "1")),
        ("robot.speed * time + 1 m", ValueType(float, "m")),
        ("robot.speed / 2 s < 1 m/s²", ValueType(bool)),
        ("2 m / 1 s < 0.5 m/s", ValueType(bool)),
        ("pose.x * pose.y < 4 m * 1 m", ValueType(bool)),
        ("1 / 2 s > 3 Hz", ValueType(bool)),
        ("battery.charge < 0.3", ValueType(bool)),
        ("$plain < 3 s", ValueType(bool)),
        ("7 % 2", INT),
        ("7 m % 2 m", ValueType(float, "m")),
        ("abs(-3)", INT),
        ("min(1, 2 m)", ValueType(float, "m")),
        ("[1, 2 m]", ValueType(list, item=ValueType(float, "m"))),
    ],
)
def test_types_of_arithmetic(source, expected):
    assert kind_of(source) == expected


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("2 m * pose.x < 3 s", "cannot compare number in m² and duration"),
        ("pose.x * pose.x < 1 m", "cannot compare number in m² and number in m"),
        ("2 m / 1 s < 0.5 m", "cannot compare number in m/s and number in m"),
        ("battery.charge < 3 s", "cannot compare number without unit and duration"),
        ("robot.turning + 1 / 2 s > 1", "cannot add number in rad/s and number in Hz"),
        ("robot.speed < 20 %", "cannot compare number in m/s and number without unit"),
        ("time % 2 m < 1", "cannot divide duration and number in m"),
    ],
)
def test_wrong_units(source, sentence):
    assert kind_of(source) == [sentence]


EXACT = 2**53
BIG = """
arguments: {{a: {{type: {kind}, default: {number}}}}}
blackboard: {{b: {{type: {kind}, initial: {number}}}}}
run: {{set: {{b: {number}}}, when: $a == {number} and $b == {number}}}
"""


@pytest.mark.parametrize("number", [EXACT + 1, 2**62 + 1, 2**63 - 1])
def test_whole_numbers_of_64_bits_keep_their_value_everywhere(tmp_path, number):
    it = ran(tmp_path, BIG.format(kind="int", number=number))
    it.ticks()
    assert it.tree.values() == {"b": number}
    assert it.changes() == [  # not skipped: the comparisons are exact
        "set: idle > success", f"when $a == {number} and $b == {number}: idle > success",
    ]  # fmt: skip
    assert read_text(tmp_path, BIG.format(kind="int", number=1), a=f"{number}").arguments == {
        "a": number
    }


@pytest.mark.parametrize(
    ("text", "errors"),
    [
        (BIG.format(kind="int", number=2**63), ["E012"] * 3),
        (BIG.format(kind="float", number=EXACT + 1), ["E108"] * 2),
        ("run: {wait: 9007199254740993 s}", ["E132"]),
        ("run: {wait: 9007199254740993.0}", ["E012"]),
        ("run: {check: time > 9007199254740993 s}", ["E150"]),
        ("run: {check: time > 9223372036854775808}", ["E150"]),
    ],
)
def test_numbers_without_an_exact_value_are_refused(tmp_path, text, errors):
    with pytest.raises(InputError) as caught:
        read_text(tmp_path, text)
    assert [item.code for item in caught.value.findings] == errors


def test_floating_point_numbers_with_an_exact_value_are_accepted(tmp_path):
    text = f"blackboard: {{x: {{type: float, initial: {EXACT * 2}}}}}\nrun: {{say: '${{$x}}'}}"
    assert read_text(tmp_path, text).blackboard["x"].value == EXACT * 2.0
