"""Which settings are tried: even, within their ranges, the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.tuning.ranges import Range
from missions.tuning.sampling import halton, refined_box, sampled

SPEED = Range("controller.cruise_speed", 0.4, 0.8)
COUNT = Range("controller.samples", 3.0, 7.0, whole=True)
SMOOTHER = Range("planner.smoother", values=("simple", "constrained", "none"))

ENDS = st.floats(-1e3, 1e3, allow_subnormal=False)


@pytest.mark.parametrize(("dimension", "base", "power"), [(0, 2, 5), (1, 3, 3), (2, 5, 2)])
@given(seed=st.integers(0, 1000))
@settings(deadline=None, max_examples=10)
def test_the_first_points_fill_every_interval_once(dimension, base, power, seed):
    """A van der Corput sequence: one of the first bᵏ points in each of bᵏ equal intervals."""
    cells = base**power
    column = halton(cells, dimension + 1, seed)[:, dimension]
    assert sorted(np.floor(column * cells).astype(int)) == list(range(cells))


@given(ENDS, ENDS, st.integers(0, 10**6), st.integers(1, 40))
@settings(deadline=None, max_examples=50)
def test_numbers_stay_within_their_range(one, other, seed, points):
    low, high = min(one, other), max(one, other) + 1e-3
    for sample in sampled([Range("controller.x", low, high)], points, seed):
        assert low <= float(sample["controller.x"]) <= high


@given(st.integers(-5, 5), st.integers(1, 9), st.integers(0, 10**6))
@settings(deadline=None, max_examples=50)
def test_whole_numbers_stay_whole_and_reach_both_ends(low, width, seed):
    given_range = Range("controller.n", float(low), float(low + width), whole=True)
    found = [one["controller.n"] for one in sampled([given_range], 64, seed)]
    assert sorted(map(int, found)) == list(range(low, low + width + 1))  # each once


def test_the_same_seed_gives_the_same_settings_and_more_points_add_to_them():
    ranges = [SPEED, COUNT, SMOOTHER]
    some, more = sampled(ranges, 6, 1), sampled(ranges, 12, 1)
    assert more[:6] == some
    assert sampled(ranges, 6, 2) != some
    assert {one["planner.smoother"] for one in more} == set(SMOOTHER.values)


def test_a_value_has_four_digits():
    texts = [one["controller.cruise_speed"] for one in sampled([SPEED], 20, 0)]
    assert max(map(len, texts)) <= len("0.1234")


@given(st.floats(0.0, 1.0, exclude_max=True))
@settings(deadline=None, max_examples=50)
def test_a_value_lies_where_its_share_says(share):
    for item in (COUNT, SMOOTHER):
        text = item.text_at(share)
        assert item.text_at(item.share_of(text)) == text
    assert SPEED.share_of(SPEED.text_at(share)) == pytest.approx(share, abs=2e-4)


def test_refinement_stays_round_the_best_and_halves():
    ranges = [SPEED, SMOOTHER]
    best = [
        {"controller.cruise_speed": "0.6", "planner.smoother": "simple"},
        {"controller.cruise_speed": "0.42", "planner.smoother": "simple"},
        {"controller.cruise_speed": "0.78", "planner.smoother": "constrained"},
    ]
    first, second = (refined_box(ranges, best, turn) for turn in (1, 2))
    assert first[0] == pytest.approx((0.25, 0.75))  # 0.6 is at 0.5
    assert second[0] == pytest.approx((0.375, 0.625))
    assert first[1] == pytest.approx((0.0, 2 / 3))
    drawn = sampled(ranges, 30, 3, first)
    assert {one["planner.smoother"] for one in drawn} == {"simple", "constrained"}
    assert all(0.5 <= float(one["controller.cruise_speed"]) <= 0.7 for one in drawn)


@given(st.lists(st.floats(0.4, 0.8), min_size=1, max_size=6), st.integers(1, 5))
@settings(deadline=None, max_examples=50)
def test_a_box_lies_within_the_range_and_holds_the_best(speeds, turn):
    best = [{"controller.cruise_speed": repr(speed)} for speed in speeds]
    ((low, high),) = refined_box([SPEED], best, turn)
    assert 0.0 <= low < high <= 1.0 and high - low <= 0.5**turn + 1e-9
    assert low - 1e-9 <= SPEED.share_of(repr(speeds[0])) <= high + 1e-9
