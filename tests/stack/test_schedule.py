from hypothesis import given
from hypothesis import strategies as st

from stack.schedule import Schedule


@given(rate=st.floats(0.05, 500.0), seconds=st.floats(1.0, 200.0))
def test_any_rate_comes_its_number_of_times_on_a_clock_of_steps(rate, seconds):
    steps, schedule = int(seconds * 500.0), Schedule(500.0 / rate)
    taken = sum(schedule.take(step) for step in range(steps + 1))
    assert abs(taken - (1 + steps / 500.0 * rate)) <= 1.0


@given(rate=st.floats(0.05, 20.0), period=st.sampled_from([0.01, 0.02, 0.05]))
def test_sums_of_control_periods_do_not_lose_a_time(rate, period):
    """0.1 + 0.1 + 0.1 is not 0.3; a comparison without tolerance comes one period late."""
    schedule, time, taken = Schedule(1.0 / rate), 0.0, 0
    for _ in range(2000):
        taken += schedule.take(time)
        time += period
    assert abs(taken - (1 + 1999 * period * rate)) <= 1.0


@given(rate=st.floats(1.0, 500.0), now=st.integers(0, 10_000))
def test_the_due_step_is_the_first_one_that_is_taken(rate, now):
    schedule = Schedule(500.0 / rate)
    for step in range(now % 700):
        schedule.take(step)
    due = schedule.due_step
    assert schedule.is_due(due)
    assert not schedule.is_due(due - 1)


def test_a_rate_that_divides_the_clock_is_due_at_its_multiples():
    schedule = Schedule(500.0 / 10.0)
    assert [step for step in range(201) if schedule.take(step)] == [0, 50, 100, 150, 200]


def test_after_a_pause_the_next_time_is_at_once_and_the_following_a_period_later():
    schedule = Schedule(0.2)
    assert schedule.take(0.0)
    assert schedule.take(1.05)  # asked for again
    assert not schedule.take(1.2)
    assert schedule.take(1.25)
