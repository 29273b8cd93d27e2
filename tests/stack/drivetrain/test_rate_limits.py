"""One limit of change for speeds: forward, backward, through zero, and for arrays."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.drivetrain.limits import limit_speed, limit_speeds

RISE, FALL = 1.0, 2.0
speeds = st.floats(-2.0, 2.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_slowing_down_and_speeding_up_are_the_same_in_both_directions(sign):
    assert limit_speed(sign * 0.5, sign * 1.0, 0.1, RISE, FALL) == pytest.approx(sign * 0.6)
    assert limit_speed(sign * 0.5, 0.0, 0.1, RISE, FALL) == pytest.approx(sign * 0.3)
    assert limit_speed(sign * 0.5, sign * 0.45, 0.1, RISE, FALL) == sign * 0.45
    assert limit_speed(0.0, sign * 1.0, 0.1, RISE, FALL) == pytest.approx(sign * 0.1)


def test_a_change_of_direction_slows_down_to_zero_and_speeds_up_with_the_time_left():
    # 0.1 m/s at 2 m/s² takes 0.05 s; the other 0.05 s at 1 m/s² give 0.05 m/s.
    assert limit_speed(0.1, -1.0, 0.1, RISE, FALL) == pytest.approx(-0.05)
    assert limit_speed(-0.1, 1.0, 0.1, RISE, FALL) == pytest.approx(0.05)
    assert limit_speed(0.1, -0.02, 0.1, RISE, FALL) == -0.02
    assert limit_speed(0.5, -1.0, 0.1, RISE, FALL) == pytest.approx(0.3)


@given(speeds, speeds, st.integers(1, 5))
def test_many_short_periods_are_one_long_period(last, wanted, parts):
    whole, reached = limit_speed(last, wanted, 0.5, RISE, FALL), last
    for _ in range(parts):
        reached = limit_speed(reached, wanted, 0.5 / parts, RISE, FALL)
    assert reached == pytest.approx(whole, abs=1e-9)


@given(speeds, st.lists(speeds, min_size=1, max_size=4), st.floats(0.01, 2.0))
def test_arrays_follow_the_same_rule(last, wanted, time):
    found = limit_speeds(last, np.array(wanted), np.array([0.5 * time, time]), RISE, FALL)
    expected = [[limit_speed(last, w, t, RISE, FALL) for t in (0.5 * time, time)] for w in wanted]
    assert found == pytest.approx(np.array(expected), abs=1e-12)
