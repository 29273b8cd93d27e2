"""Comparisons that ranges make constant: found with their reason, and never a false alarm."""

from dataclasses import replace
from math import pi

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from behaviours.testing import ScriptedRobot
from missions.execution.fit.speeds import speed_findings
from missions.execution.resources import load_robot
from missions.inspection.check import check_files
from missions.language.analysis.intervals import Interval, numbers, truth_values
from missions.language.analysis.ranges import constant_comparisons
from missions.language.expressions.expression import NameContext, check_expression
from missions.language.expressions.scope import Role, Scope, Symbol
from missions.language.expressions.value_types import NUMBER
from stack.documents import Mark
from stack.errors import EvaluationError
from stack.types import Battery, Pose2D
from tests.missions.mission_fakes import read_text

RANGES = {"a": (-2.0, 5.0), "b": (0.5, 3.0), "c": (-1.0, 0.0)}
SYMBOLS = {
    name: Symbol(name, Role.ARGUMENT, NUMBER, Mark("test"), 0.0, limits=limits)
    for name, limits in RANGES.items()
}
AROUND = NameContext(Scope((SYMBOLS,)))
NAMES = st.sampled_from(["$a", "$b", "$c", "battery.charge"])
LITERALS = st.integers(-3, 20).map(lambda n: f"({n / 4})" if n % 2 else str(n / 4).lstrip("-"))


def combined(parts):
    return st.one_of(
        st.tuples(parts, st.sampled_from("+-*/"), parts).map(lambda it: f"({' '.join(it)})"),
        st.tuples(parts, parts).map(lambda it: f"min({it[0]}, {it[1]})"),
        st.tuples(parts, parts).map(lambda it: f"max({it[0]}, {it[1]})"),
        parts.map(lambda it: f"abs({it})"),
        parts.map(lambda it: f"(-{it})"),
    )  # fmt: skip


TERMS = st.recursive(st.one_of(NAMES, LITERALS), combined, max_leaves=6)
CONDITIONS = st.tuples(TERMS, st.sampled_from(["<", "<=", ">", ">=", "==", "!="]), TERMS)


class Values:
    """Names with these values, in place of a running tree."""

    def __init__(self, values, charge):
        self.values, self.robot = values, ScriptedRobot(battery=Battery(charge=charge))
        self.context = self.bindings = self

    def reader(self, name):
        return lambda: self.values[name]


@settings(deadline=None, max_examples=300)
@given(condition=CONDITIONS, data=st.data())
def test_no_value_within_the_ranges_contradicts_a_constant_comparison(condition, data):
    checked, _ = check_expression(" ".join(condition), AROUND)
    if checked is None:
        return  # a division by zero, for example
    known = {f"${name}": Interval(*limits) for name, limits in RANGES.items()}
    possible = truth_values(checked.term, known)
    values = {name: data.draw(st.floats(*limits)) for name, limits in RANGES.items()}
    names = Values(values, data.draw(st.floats(0.0, 1.0)))
    try:
        left, right = checked.term.left.bind(names)(), checked.term.right.bind(names)()
        truth = checked.term.bind(names)()
    except EvaluationError:
        return
    assert truth in possible
    for term, value in ((checked.term.left, left), (checked.term.right, right)):
        found = numbers(term, known)
        assert found.least <= value <= found.most


@pytest.mark.parametrize("bound", [0.0, 0.2, 1.0])
def test_the_ends_of_a_range_can_be_reached(bound):
    """battery.charge is in [0, 1]: comparisons with its ends are open, beyond them they are not."""
    for word in ("<", "<=", ">", ">="):
        checked, _ = check_expression(f"battery.charge {word} {bound}", AROUND)
        constant = [value for _, value in constant_comparisons(checked)]
        expected = {
            ("<", 0.0): [False],
            (">=", 0.0): [True],
            (">", 1.0): [False],
            ("<=", 1.0): [True],
        }
        assert constant == expected.get((word, bound), [])


HEAD = """mission: a
robot: scout
world: office
arguments:
  soc: {type: float, default: 0.3, range: [0, 1]}
  mode: {type: text, one_of: [fast, slow], default: fast}
  dwell: {type: duration, default: 3 s, range: [1 s, 10 s]}
"""
USES = "- {say: '${$soc} ${$mode} ${$dwell}'}\n"


def found(folder, condition):
    """The findings of a mission with a node that has this condition: `code`, message."""
    file = folder / "mission.yaml"
    file.write_text(f'{HEAD}run:\n  sequence:\n  - {{wait: 1 s, when: "{condition}"}}\n  {USES}')
    return [(item.finding.code, item.text.splitlines()[0]) for item in check_files([str(file)])]


@pytest.mark.parametrize(
    ("condition", "code", "says"),
    [
        ("battery.charge < 20", "W107", "true; battery.charge is between 0 and 1: write 20 %"),
        ("battery.charge == 100", "W107", "always false: the node never runs; battery.charge"),
        ("localisation.health > 1", "W107", "localisation.health is between 0 and 1"),
        ("100 * battery.charge > 120", "W107", "always false"),
        ("pose.heading > 180", "W107", "a number alone is in radians: write 180 deg"),
        ("abs(pose.heading) < 90", "W107", "a number alone is in radians: write 90 deg"),
        ("pose.heading < -200 deg", "W107", "pose.heading is between -180 and 180 deg"),
        ("time < 0", "W107", "time is at least 0 s"),
        ("min(battery.charge, 0.5) > 0.7", "W107", "always false"),
        ("distance(pose, pose) < 0", "W107", "always false"),
        ("$soc > 20", "W107", "$soc is between 0 and 1"),
        ("$dwell > 20 s", "W107", "$dwell is between 1 and 10 s"),
        ("$mode == 'quick'", "W107", "$mode is one of fast, slow"),
        ("time > 3 s or battery.charge > 50", "W107", "battery.charge > 50 is always false; "),
        ("robot.speed > 5", "W141", "is never true: scout drives at most at 0.8 m/s"),
        ("robot.turning < 90", "W141", "is always true: scout turns at most at 1.8 rad/s"),
        ("time > 3 s and robot.speed > 3 m/s", "W141", "robot.speed > 3 m/s is never true"),
        ("time > 3 m", "E152", "cannot compare duration and number in m"),
    ],
)  # fmt: skip
def test_a_comparison_outside_a_range_is_one_finding_with_its_reason(
    tmp_path, condition, code, says
):
    [(found_code, text)] = found(tmp_path, condition)
    assert found_code == code and says in text, text


@pytest.mark.parametrize(
    "condition",
    [
        "battery.charge < 20 %", "battery.charge * 100 < 20", "localisation.health >= 1",
        "pose.heading > 90 deg", "pose.heading > 3.1", "abs(pose.heading) < 90 deg", "time <= 0",
        "robot.speed < 0.02", "robot.speed > 0.8", "robot.speed > 0.9 m/s", "robot.turning > 1.8",
        "$soc < battery.charge", "$soc > 0.9", "$dwell > 9 s", "$mode == 'slow'",
        "battery.charge / 2 > 0.4", "max(battery.charge, 0.5) > 0.7", "pose.x > 1000",
    ],
)  # fmt: skip
def test_a_comparison_within_the_ranges_is_no_finding(tmp_path, condition):
    """A measured speed may exceed the limit of the commanded one by a little."""
    assert found(tmp_path, condition) == []


def test_a_check_that_never_fails_says_why_what_follows_is_never_reached(tmp_path):
    file = tmp_path / "mission.yaml"
    text = "run: {fallback: [{check: battery.charge < 20}, {say: low}]}\n"
    file.write_text(f"mission: a\nrobot: scout\nworld: office\n{text}")
    [item] = check_files([str(file)])
    assert item.finding.code == "E160"
    assert item.finding.sentence.endswith("never fails: battery.charge < 20 is always true")
    assert item.finding.hint == "battery.charge is between 0 and 1: write 20 %"


def test_the_speed_of_an_omnidirectional_robot_has_two_parts(tmp_path):
    """Glide drives at 0.7 m/s along and 0.7 m/s across: 0.99 m/s, measured up to 1.24 m/s."""
    glide = load_robot("glide", tmp_path)
    for speed, expected in ((1.2, []), (1.3, ["W141"])):
        mission = read_text(tmp_path, f"run: {{wait: 1 s, when: robot.speed > {speed}}}")
        assert [item.code for item in speed_findings(mission, glide)] == expected


def test_every_way_to_write_a_condition_is_compared_with_the_robot(tmp_path):
    text = """
    events: [{a: {when: robot.speed > 3, do: {say: a}}}]
    run:
      sequence:
        - {wait: 1 s, when: robot.speed > 4}
        - {wait: 1 s, while: robot.speed < 5}
        - {wait: 1 s, repeat: {until: robot.speed > 6}}
        - {spin: 90 deg, recover: {attempts: 2, unless: robot.speed > 7, round_robin: [{say: a}]}}
        - {wait_until: robot.speed > 8, timeout: 3 s}
        - use: t
    trees:
      t: {do: {check: robot.speed < 9}}
    """
    found = speed_findings(read_text(tmp_path, text), load_robot("scout", tmp_path))
    assert [item.mark.line for item in found] == [2, 5, 6, 7, 8, 9, 12]


@pytest.mark.parametrize("behaviour", ["back_up", "undock", "drive_on_heading"])
def test_speeds_backward_are_compared_with_the_speed_in_reverse(tmp_path, behaviour):
    """Of a robot that drives at 0.8 m/s forward and at 0.2 m/s in reverse."""
    scout = load_robot("scout", tmp_path)
    slow = replace(scout, limits=replace(scout.limits, reverse_speed=0.2))
    mission = read_text(tmp_path, f"run: {{{behaviour}: {{distance: 1 m, speed: 0.3 m/s}}}}")
    expected = [] if behaviour == "drive_on_heading" else ["W141"]
    assert [item.code for item in speed_findings(mission, slow)] == expected


def test_headings_of_the_robot_are_wrapped():
    assert abs(Pose2D(0.0, 0.0, 1.0).compose(Pose2D(0.0, 0.0, 3.0)).heading) <= pi
