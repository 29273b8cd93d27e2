"""The clock of a device behind a link with random delays, against the true clock."""

import random

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from stack.clock import MAX_DRIFT, DeviceClock

RATE, SHORTEST = 20.0, 0.004


def messages(rng, begin, end, offset, drift=0.0, jitter=0.003, lost=0.2, late=0.05):
    """(stamp, arrival, true time) of what comes: our clock = stamp * (1 + drift) + offset."""
    sent = []
    for n in range(round(begin * RATE), round(end * RATE)):
        stamp = n / RATE
        true = stamp * (1.0 + drift) + offset
        delay = SHORTEST + rng.expovariate(1.0 / jitter)
        if rng.random() < late:
            delay += rng.uniform(0.05, 3.0)
        if rng.random() >= lost:
            sent.append((stamp, true + delay, true))
    return sorted(sent, key=lambda message: message[1])  # a late one is overtaken


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 10**6), st.floats(-1e6, 1e6), st.floats(-0.8 * MAX_DRIFT, 0.8 * MAX_DRIFT),
    st.floats(0.0, 0.6), st.floats(0.0, 0.3),
)  # fmt: skip
@example(3, 0.0, 1e-4, 0.2, 0.1)
@example(16153, 0.0, 0.0, 0.5, 0.25)  # five overtaken messages in turn
def test_offset_and_drift_are_found_in_spite_of_late_and_lost_messages(
    seed, offset, drift, lost, late
):
    clock, rng = DeviceClock(), random.Random(seed)
    errors = []
    for stamp, arrival, true in messages(rng, 0, 90, offset, drift, lost=lost, late=late):
        converted = clock.convert(stamp, arrival)
        if converted is None:  # overtaken by messages of three seconds later
            assert arrival - true > 2.9
            continue
        assert converted <= arrival
        if stamp > 20.0:
            errors.append(abs(converted - true - SHORTEST))
    # The quickest of some ten messages of a second is late by 0.3 ms on the average (3 ms / 10).
    assert sorted(errors)[len(errors) // 2] < 0.002 and max(errors) < 0.008
    assert clock.drift == pytest.approx(drift, abs=6e-5) and clock.restarts == 0


@pytest.mark.parametrize("after", [0.0, 1.0, 500.0])
def test_a_restarted_device_has_another_clock(after):
    clock, rng = DeviceClock(), random.Random(1)
    for stamp, arrival, _ in messages(rng, 100, 130, 1000.0):
        clock.convert(stamp, arrival)
    restarted = messages(rng, after, after + 5, 1135.0 - after, lost=0.0, late=0.0)
    converted = [clock.convert(stamp, arrival) for stamp, arrival, _ in restarted]
    assert clock.restarts == 1 and converted[:4] == [None] * 4
    errors = [one - true for one, (_, _, true) in zip(converted[4:], restarted[4:], strict=True)]
    assert all(0.0 <= error < 0.03 for error in errors)


def test_a_single_wrong_stamp_changes_nothing():
    clock, rng = DeviceClock(), random.Random(2)
    for n, (stamp, arrival, true) in enumerate(messages(rng, 0, 40, 7.0, late=0.0)):
        if n % 50 == 25:
            assert clock.convert(rng.choice([1e9, -5.0]), arrival) is None
        assert clock.convert(stamp, arrival) - true < 0.02
    assert clock.restarts == 0


def test_a_stalled_link_does_not_move_the_stamps():
    clock, rng = DeviceClock(), random.Random(3)
    for stamp, arrival, _ in messages(rng, 0, 30, 7.0, lost=0.0, late=0.0):
        clock.convert(stamp, arrival)
    burst = 30.0 + 5.0 + 7.0  # all messages of 5 s come at once
    for n in range(100):
        stamp = 30.0 + n / RATE
        assert clock.convert(stamp, burst) == pytest.approx(stamp + 7.0 + SHORTEST, abs=0.002)


def test_a_device_that_slept_is_believed_after_some_seconds():
    clock, rng = DeviceClock(), random.Random(4)
    for stamp, arrival, _ in messages(rng, 0, 30, 7.0, lost=0.0, late=0.0):
        clock.convert(stamp, arrival)
    errors = [
        clock.convert(stamp, arrival) - true
        for stamp, arrival, true in messages(rng, 30, 45, 12.0, lost=0.0, late=0.0)
    ]
    assert errors[0] == pytest.approx(-5.0, abs=0.01)
    assert clock.restarts == 1 and abs(errors[-1]) < 0.01


def test_a_clock_that_does_not_run_yet_teaches_nothing():
    """A simulation that has not begun sends the time 0 again and again."""
    clock, rng = DeviceClock(), random.Random(5)
    for n in range(60):
        clock.convert(0.0, 10.0 + 0.05 * n)
    for stamp, arrival, true in messages(rng, 0.05, 5, 13.0, lost=0.0, late=0.0):
        assert clock.convert(stamp, arrival) - true < 0.02
    assert clock.restarts == 0


def test_a_clock_that_stood_for_a_moment_is_followed_within_seconds():
    """A simulation that cannot keep up with the wall clock loses half a second now and then."""
    clock, rng = DeviceClock(), random.Random(6)
    for stamp, arrival, _ in messages(rng, 0, 30, 7.0, lost=0.0, late=0.0):
        clock.convert(stamp, arrival)
    errors = [
        clock.convert(stamp, arrival) - true
        for stamp, arrival, true in messages(rng, 30, 40, 7.5, lost=0.0, late=0.0)
    ]
    assert errors[0] == pytest.approx(-0.5, abs=0.01)
    assert all(abs(error) < 0.01 for error in errors[round(4.5 * RATE) :])
