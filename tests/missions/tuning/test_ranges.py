"""What may be tried, and what is refused before anything moves."""

from __future__ import annotations

import pytest

from missions.execution.prepare import RunOptions, prepare
from missions.tuning.ranges import Range, read_ranges
from stack.errors import InputError


@pytest.fixture(scope="module")
def plan():
    return prepare("01_drive_to_a_point", RunOptions())


@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("controller.cruise_speed", "0.4..0.8", (0.4, 0.8)),
        ("controller.cruise_speed", "40 cm/s .. 0.8 m/s", (0.4, 0.8)),
        ("costmap.inflation_radius", "30 cm..60 cm", (0.3, 0.6)),
        ("planner.cost_weight", "1..5", (1.0, 5.0)),
    ],
)
def test_a_range_with_or_without_units(plan, name, text, expected):
    (found,) = read_ranges({name: text}, plan)
    assert (found.low, found.high, found.whole) == (*map(pytest.approx, expected), False)


def test_whole_numbers_and_alternatives(plan):
    given = {"planner.max_expansions": "5..9", "planner.smoother": "simple, constrained"}
    assert read_ranges(given, plan) == [
        Range("planner.max_expansions", 5.0, 9.0, whole=True),
        Range("planner.smoother", values=("simple", "constrained")),
    ]
    assert read_ranges({"controller.use": "pure_pursuit,mppi"}, plan)[0].values[1] == "mppi"
    assert read_ranges({"planner.allow_unknown": "true,false"}, plan)[0].values == ("true", "false")


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("planner.tolerance", "0.1..9",
         "--try planner.tolerance=0.1..9: 9 m must be at most 5 m; allowed: >= 0 and <= 5"),
        ("controller.cruise_sped", "1..2", "no parameter 'cruise_sped'; did you mean 'cruise_sp"),
        ("controler.cruise_speed", "1..2", "no 'controler'; did you mean 'controller'"),
        ("cruise_speed", "1..2", "--try cruise_speed: expected KIND.NAME, e.g. controller"),
        ("controller.cruise_speed", "fast..faster", "expected a number in m/s, got 'fast'"),
        ("controller.cruise_speed", "0.8..0.4", "0.8 is not below 0.4"),
        ("controller.cruise_speed", "1 kg..2 kg", "'1 kg' is in kg"),
        ("planner.max_expansions", "1.5..3", "expected a whole number, got 1.5"),
        ("planner.smoother", "simple..none", "text has no range; list values, as in planner.smo"),
        ("planner.smoother", "simple,rough", "'rough' is not one of"),
        ("planner.smoother", "none,none", "expected LOW..HIGH or distinct values"),
        ("controller.use", "pure_pursuit,mpi", "did you mean 'mppi'"),
    ],
)  # fmt: skip
def test_what_will_not_do_is_refused_with_name_and_range(plan, name, text, sentence):
    with pytest.raises(InputError) as refused:
        read_ranges({name: text}, plan)
    assert sentence in str(refused.value)


def test_nothing_to_try_and_parameters_of_a_component_that_changes(plan):
    with pytest.raises(InputError, match="nothing to try"):
        read_ranges({}, plan)
    both = {"controller.use": "mppi,dwb", "controller.cruise_speed": "0.3..0.5"}
    with pytest.raises(InputError, match="is not the same parameter for each controller"):
        read_ranges(both, plan)
