"""What runs cost: by hand, from rows that nobody drove."""

from __future__ import annotations

from dataclasses import replace

import pytest

from missions.sweeps.row import SweepRow
from missions.tuning.objectives import (
    FAILED,
    WORST_SUCCESS,
    cost_of,
    means_of,
    read_objectives,
    read_weights,
)
from missions.tuning.scoring import best_first, front_of, score_of
from stack.errors import InputError

RUN = SweepRow(
    0, 0, {}, "success", seconds=20.0, distance=11.0, detour=1.1, clearance=0.2, turning=0.5,
    jerk=4.0, goal_error=0.05, collisions=0,
)  # fmt: skip
WEIGHTS = read_weights({})
"""time 1, detour 0.5, clearance 0.5, turning 0.5, jerk 0.25, goal_error 0.5: 3.25 together."""
COST = read_objectives([], [], WEIGHTS)
BOTH = read_objectives(["time"], ["clearance"], WEIGHTS)


def cost(**changes):
    return cost_of(replace(RUN, **changes), means_of([RUN]), WEIGHTS)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, 1.0),
        ({"seconds": 40.0}, (2.0 + 2.25) / 3.25),
        ({"clearance": 0.4}, (2.75 + 0.5 * 0.5) / 3.25),  # twice the clearance is half as bad
        ({"clearance": 0.1}, (2.75 + 0.5 * 2.0) / 3.25),
        ({"clearance": None}, (2.75 + 0.5 * 0.2) / 3.25),  # nothing within 1 m
        ({"detour": 1.0}, (2.75 + 0.5 * 1.0 / 1.1) / 3.25),
        ({"goal_error": 0.001}, (2.75 + 0.5 * 0.02 / 0.05) / 3.25),  # no better than its floor
        ({"goal_error": None}, 1.0),  # no goals: the rest counts
        ({"seconds": 2000.0}, (5.0 + 2.25) / 3.25),  # a ratio ends at 5
        ({"collisions": 2}, 3.0),
        ({"collisions": 50}, WORST_SUCCESS),
        ({"outcome": "failure", "seconds": 1.0}, FAILED),
        ({"outcome": "time limit"}, FAILED),
    ],
)
def test_the_cost_of_a_run(changes, expected):
    assert cost(**changes) == pytest.approx(expected)


def test_only_what_has_weight_counts():
    weights = read_weights({name: "0" for name in WEIGHTS if name != "jerk"})
    run = replace(RUN, seconds=99.0, jerk=2.0, collisions=3)
    assert cost_of(run, means_of([RUN]), weights) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"tme": "1"}, "--weight tme: unknown measure; did you mean 'time'"),
        ({"time": "much"}, "--weight time=much: expected a number from 0"),
        ({"time": "-1"}, "--weight time=-1: expected a number from 0"),
        ({"time": "nan"}, "--weight time=nan: expected a number from 0"),
        ({name: "0" for name in WEIGHTS}, "every measure has weight 0"),
    ],
)
def test_weights_that_will_not_do(given, sentence):
    with pytest.raises(InputError, match=sentence):
        read_weights(given)


def test_objectives_are_measures_cost_and_success():
    assert [(one.name, one.maximises) for one in COST] == [("cost", False)]
    assert [(one.name, one.maximises) for one in BOTH] == [("time", False), ("clearance", True)]
    with pytest.raises(InputError, match="--maximise tme: unknown measure; did you mean 'time'"):
        read_objectives([], ["tme"], WEIGHTS)
    with pytest.raises(InputError, match="--minimise time: it is given twice"):
        read_objectives(["time"], ["time"], WEIGHTS)


def test_a_failed_run_is_five_times_as_bad_as_the_reference():
    failed, reference = replace(RUN, outcome="failure", seconds=1.0), means_of([RUN])
    time, clearance = BOTH
    assert time.value(failed, reference) == pytest.approx(100.0)
    assert clearance.value(failed, reference) == pytest.approx(0.04)
    assert time.value(failed, {}) > time.value(failed, reference)
    assert clearance.value(failed, {}) < clearance.value(failed, reference)
    (success,) = read_objectives([], ["success"], WEIGHTS)
    assert [success.value(run, {}) for run in (RUN, failed)] == [1.0, 0.0]


def seeds(times, **changes):
    return [replace(RUN, seed=n, seconds=time, **changes) for n, time in enumerate(times)]


def scores(tried, objectives=COST):
    baseline = tried[0][1]
    good = [run for run in baseline if run.is_success]
    return [score_of(one, baseline, objectives, means_of(good)) for one in tried]


def test_differences_are_taken_seed_by_seed():
    """All seeds 2 s of 20 s faster: the seeds' own difference of 4 s is no noise of it."""
    fast = {"controller.cruise_speed": "0.7"}
    before, after = scores([({}, seeds([18.0, 20.0, 22.0])), (fast, seeds([16.0, 18.0, 20.0]))])
    (same,), (gain,) = before.differences, after.differences
    assert (before.mean(), same.gain, same.noise) == (pytest.approx(1.0), 0.0, 0.0)
    assert gain.gain == pytest.approx(-2.0 / 20.0 / 3.25)
    assert gain.noise == pytest.approx(0.0, abs=1e-12) and gain.verdict == "better"


def test_a_difference_that_not_every_seed_shows_is_noise():
    """-4, +2 and -1 s: mean -1 s, standard error √3 s; 4.3 of these would be needed."""
    _, after = scores([({}, seeds([20.0] * 3)), ({"a.b": "1"}, seeds([16.0, 22.0, 19.0]))])
    (gain,) = after.differences
    assert gain.gain == pytest.approx(-1.0 / 20.0 / 3.25)
    assert gain.noise == pytest.approx(3.0**0.5 / 20.0 / 3.25)
    assert gain.verdict == "within noise"


def test_one_seed_says_nothing_of_noise():
    _, after = scores([({}, seeds([20.0])), ({"a.b": "1"}, seeds([10.0]))])
    assert (after.differences[0].noise, after.differences[0].verdict) == (None, "one seed")


def test_more_is_better_if_it_is_maximised():
    wide = [replace(run, clearance=0.3) for run in seeds([20.0] * 3)]
    _, after = scores([({}, seeds([20.0] * 3)), ({"a.b": "1"}, wide)], BOTH)
    assert [one.verdict for one in after.differences] == ["within noise", "better"]


def test_a_setting_that_fails_once_comes_last():
    fails = [*seeds([10.0]), replace(RUN, seed=1, outcome="failure")]
    made = scores(
        [({}, seeds([20.0, 20.0])), ({"a.b": "1"}, fails), ({"a.b": "2"}, seeds([80.0, 80.0]))]
    )
    ranked = best_first(made, COST)
    assert [score.settings.get("a.b") for score in ranked] == [None, "2", "1"]
    assert ranked[-1].successes == 1 and front_of(made, COST) == ranked[:1]


def test_a_front_has_what_nothing_beats_in_every_objective():
    """(time, clearance): 20/0.2 is the baseline; 10/0.1, 15/0.15 and 30/0.3 stay, 31/0.2 not."""
    points = [(20, 0.2), (10, 0.1), (31, 0.2), (30, 0.3), (15, 0.15), (16, 0.15)]
    tried = [
        ({"a": str(n)} if n else {}, [replace(run, clearance=wide) for run in seeds([time] * 2)])
        for n, (time, wide) in enumerate(points)
    ]
    made = scores(tried, BOTH)
    assert [score.settings.get("a") for score in front_of(made, BOTH)] == ["1", "4", None, "3"]
    often = [*made[:1], replace(made[1], successes=1), replace(made[4], is_pruned=True)]
    assert [score.settings.get("a") for score in front_of(often, BOTH)] == [None]
