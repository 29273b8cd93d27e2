"""What runs cost: by hand, from rows that nobody drove."""

from __future__ import annotations

from dataclasses import replace

import pytest

from missions.bench.mission_runs import MissionRun
from missions.tuning.scoring import (
    FAILED,
    WORST_SUCCESS,
    best_first,
    cost_of,
    means_of,
    read_weights,
    scores_of,
)
from stack.errors import InputError

RUN = MissionRun(
    mission="m", settings="", seed=0, status="success", cause="", time=20.0, driven=11.0,
    shortest=10.0, clearance=0.2, turning=0.5, jerk=4.0, goal_error=0.05, collisions=0,
    pushed_into=0, recoveries=0, replans=0, localisation_error=(0.01, 0.03),
    real_time_factor=10.0, wall_seconds=1.0,
)  # fmt: skip
WEIGHTS = read_weights({})
"""time 1, detour 0.5, clearance 0.5, turning 0.5, jerk 0.25, goal_error 0.5: 3.25 together."""


def cost(**changes):
    return cost_of(replace(RUN, **changes), means_of([RUN]), WEIGHTS)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, 1.0),
        ({"time": 40.0}, (2.0 + 2.25) / 3.25),
        ({"clearance": 0.4}, (2.75 + 0.5 * 0.5) / 3.25),  # twice the clearance is half as bad
        ({"clearance": 0.1}, (2.75 + 0.5 * 2.0) / 3.25),
        ({"driven": 10.0}, (2.75 + 0.5 * 1.0 / 1.1) / 3.25),
        ({"goal_error": 0.001}, (2.75 + 0.5 * 0.02 / 0.05) / 3.25),  # no better than its floor
        ({"goal_error": None}, 1.0),  # no goals: the rest counts
        ({"time": 2000.0}, (5.0 + 2.25) / 3.25),  # a ratio ends at 5
        ({"collisions": 2}, 3.0),
        ({"collisions": 50}, WORST_SUCCESS),
        ({"status": "failure", "time": 1.0}, FAILED),
        ({"status": "timeout"}, FAILED),
    ],
)
def test_the_cost_of_a_run(changes, expected):
    assert cost(**changes) == pytest.approx(expected)


def test_only_what_has_weight_counts():
    weights = read_weights({name: "0" for name in WEIGHTS if name != "jerk"})
    run = replace(RUN, time=99.0, jerk=2.0, collisions=3)
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


def seeds(times, settings="", **changes):
    return [
        replace(RUN, settings=settings, seed=n, time=time, **changes)
        for n, time in enumerate(times)
    ]


def test_differences_are_taken_seed_by_seed():
    """All seeds 2 s of 20 s faster: the seeds' own difference of 4 s is no noise of it."""
    fast = {"controller.cruise_speed": "0.7"}
    before, after = scores_of(
        [({}, seeds([18.0, 20.0, 22.0])), (fast, seeds([16.0, 18.0, 20.0]))], WEIGHTS
    )
    assert (before.cost, before.gain, before.noise) == (pytest.approx(1.0), 0.0, 0.0)
    assert after.gain == pytest.approx(-2.0 / 20.0 / 3.25)
    assert after.noise == pytest.approx(0.0, abs=1e-12)
    assert after.worst == pytest.approx(1.0) and after.verdict == "better"


def test_a_difference_that_not_every_seed_shows_is_noise():
    """-4, +2 and -1 s: mean -1 s, standard error √3 s; 4.3 of these would be needed."""
    _, after = scores_of(
        [({}, seeds([20.0] * 3)), ({"a.b": "1"}, seeds([16.0, 22.0, 19.0]))], WEIGHTS
    )
    assert after.gain == pytest.approx(-1.0 / 20.0 / 3.25)
    assert after.noise == pytest.approx(3.0**0.5 / 20.0 / 3.25)
    assert after.verdict == "within noise"


def test_one_seed_says_nothing_of_noise():
    _, after = scores_of([({}, seeds([20.0])), ({"a.b": "1"}, seeds([10.0]))], WEIGHTS)
    assert (after.noise, after.verdict) == (None, "one seed")


def test_a_setting_that_fails_once_comes_last():
    fails = [*seeds([10.0]), replace(RUN, seed=1, status="failure")]
    scores = scores_of(
        [({}, seeds([20.0, 20.0])), ({"a.b": "1"}, fails), ({"a.b": "2"}, seeds([80.0, 80.0]))],
        WEIGHTS,
    )
    ranked = best_first(scores)
    assert [score.settings.get("a.b") for score in ranked] == [None, "2", "1"]
    assert ranked[-1].successes == 1 and ranked[-1].worst == FAILED


def test_where_the_baseline_fails_what_succeeds_is_the_reference():
    failed = [replace(RUN, status="failure", time=3.0)]
    before, after = scores_of([({}, failed), ({"a.b": "1"}, seeds([30.0]))], WEIGHTS)
    assert before.cost == FAILED and after.cost == pytest.approx(1.0)
    assert after.gain == pytest.approx(1.0 - FAILED)
