"""How long workers are waited for: by their own work, on machines of any speed and load."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from stack.patience import Patience

LONGEST = Patience.LONGEST


class Worker:
    """Computes a share of the wall time on each of some processors."""

    def __init__(self, share, threads=1):
        self.computed, self.share, self.threads = 0.0, share, threads
        self.patience = Patience(lambda: self.computed)

    def waited_for(self, until=1e4, nap=0.5):
        """Wall seconds after which it is given up."""
        wall = 0.0
        while self.patience.left and wall < until:
            self.computed += self.share * self.threads * nap
            self.patience.spend(nap)
            wall += nap
        return wall


@given(share=st.floats(0.02, 1.0))
def test_a_worker_that_computes_has_its_seconds_however_slow_the_machine_is(share):
    worker = Worker(share)
    assert worker.waited_for() == pytest.approx(LONGEST / share, abs=0.5 + 1e-6)


@given(share=st.floats(0.0, 0.009))
def test_a_worker_that_does_nothing_is_given_up_after_so_many_wall_seconds(share):
    """It may look at a clock now and then, up to 1 % of the time."""
    assert Worker(share).waited_for() == LONGEST


def test_several_threads_do_not_count_several_times():
    assert Worker(1.0, threads=8).waited_for() == LONGEST


def test_each_answer_is_waited_for_anew():
    worker = Worker(1.0)
    assert worker.waited_for(until=20.0) == 20.0
    worker.patience.begin()
    assert worker.waited_for() == LONGEST
