"""Values as they stand in files, and what they mean."""

from dataclasses import dataclass
from math import pi

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.errors import ParameterError
from stack.parameters import (
    Declaration,
    build,
    parameter,
    read_quantity,
    refuse_changes,
    values_of,
)
from stack.planning.astar import AstarParameters
from stack.types import Pose2D


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("30 cm", "m", 0.3), ("90 deg", "rad", pi / 2), ("500 ms", "s", 0.5), ("5 min", "s", 300.0),
        ("3.6 km/h", "m/s", 1.0), ("70 %", "", 0.7), ("-1.5", "m", -1.5), ("2e-3 m", "m", 0.002),
    ],
)  # fmt: skip
def test_quantities_are_read_in_si(text, unit, value):
    assert read_quantity(text, unit) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "unit", "words"),
    [
        ("2 m", "rad", "'2 m' is in m, expected an angle"),
        ("3 parsec", "m", "unknown unit 'parsec'"),
        ("soon", "s", "expected a duration, got 'soon'"),
        ("1e999 m", "m", "is not a finite number"),
    ],
)
def test_wrong_quantities_say_what_was_expected(text, unit, words):
    with pytest.raises(ParameterError, match=words):
        read_quantity(text, unit)


POSE = Declaration("goal", Pose2D)


def test_a_pose_takes_degrees_and_wraps_its_heading():
    assert POSE.read([1, 2, "270 deg"]) == Pose2D(1.0, 2.0, pytest.approx(-pi / 2))


def test_ninety_without_a_unit_is_not_taken_for_ninety_radians():
    with pytest.raises(ParameterError, match="90 rad is more than a full turn") as caught:
        POSE.read([1, 2, 90])
    assert caught.value.hint == "write 90 deg"


@pytest.mark.parametrize("raw", [[1], [1, 2, 3, 4], "here", [1, "x"], [1, 1.1e6], None, True])
def test_wrong_poses_are_refused(raw):
    with pytest.raises(ParameterError):
        POSE.read(raw)


@given(st.floats(-1e6, 1e6), st.floats(-1e6, 1e6), st.floats(-pi, pi, exclude_min=True))
def test_any_pose_reads_back(x, y, heading):
    pose = POSE.read([x, y, heading])
    assert (pose.x, pose.y) == (x, y)
    assert pose.heading == pytest.approx(heading, abs=1e-9)


@pytest.mark.parametrize("name", [None, 30, True, 2.5])
def test_a_key_that_is_no_text_is_an_unknown_parameter(name):
    with pytest.raises(ParameterError, match=f"there is no parameter {name!r} here"):
        build(AstarParameters, {name: 1})


@dataclass(frozen=True)
class Band:
    slow: float = parameter(0.2, "m/s", not_above="fast", help="lower speed")
    fast: float = parameter(0.5, "m/s", help="higher speed; 0: off")


@pytest.mark.parametrize(
    ("values", "error"),
    [
        ({"slow": 0.8}, "slow: 0.8 m/s is above fast 0.5 m/s"),
        ({"slow": 0.8, "fast": 0.3}, "slow: 0.8 m/s is above fast 0.3 m/s"),
        ({"fast": 0.1}, "fast: 0.1 m/s is less than slow 0.2 m/s"),
    ],
)
def test_values_that_contradict_each_other_are_refused_at_what_is_written(values, error):
    with pytest.raises(ParameterError) as caught:
        build(Band, values)
    assert str(caught.value) == error


def test_equal_values_and_one_that_is_off_do_not_contradict():
    assert build(Band, {"slow": 0.5}).slow == 0.5
    assert build(Band, {"slow": 0.8, "fast": 0.0}).fast == 0.0


def test_the_other_value_is_in_the_hint():
    with pytest.raises(ParameterError) as caught:
        build(Band, {"fast": 0.1})
    assert caught.value.hint == "use at least 0.2 m/s, or a lower slow"


def test_values_of_a_dataclass_are_the_objects_themselves():
    pose = Pose2D(1.0, 2.0, 0.5)
    assert values_of(pose) == {"x": 1.0, "y": 2.0, "heading": 0.5}
    declared = Declaration("goal", Pose2D, default=pose)
    assert values_of(declared)["default"] is pose  # `dataclasses.asdict` makes a mapping of it


def test_a_fixed_parameter_cannot_change_and_others_can():
    before, after = Pose2D(1.0, 2.0, 0.5), Pose2D(1.0, 3.0, 0.5)
    refuse_changes(("x", "heading"), before, after)
    with pytest.raises(ParameterError, match="y: cannot be changed during a run"):
        refuse_changes(("x", "y"), before, after)
