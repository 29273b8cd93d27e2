"""Jobs that hang, in a thread: given up in time, and later ones with them."""

from threading import Event

import pytest

from stack.errors import WorkerError
from stack.patience import Patience
from stack.worker_thread import WorkerThread


@pytest.fixture
def worker(monkeypatch):
    monkeypatch.setattr(Patience, "LONGEST", 0.2)
    made = WorkerThread("the thinker")
    yield made
    made.close()


def test_results_and_exceptions_come_from_the_jobs(worker):
    assert worker.result(worker.submit(lambda: 3)) == 3
    with pytest.raises(ZeroDivisionError):
        worker.result(worker.submit(lambda: 1 / 0))
    assert worker.result(worker.submit(lambda: 4)) == 4


def test_a_job_that_hangs_is_given_up_and_so_are_later_ones_until_it_ends(worker):
    release, second = Event(), Event()
    hanging = worker.submit(release.wait)
    waiting = worker.submit(second.set)
    while not worker.await_job(hanging, 0.01):
        pass
    for job in (hanging, waiting):  # the second is not waited for once more
        with pytest.raises(WorkerError, match=r"the thinker gave no result for 0\.2 s"):
            worker.result(job)
    release.set()
    assert second.wait(60.0)
    assert worker.result(worker.submit(lambda: 5)) == 5


def test_closing_does_not_wait_for_a_job_that_hangs(worker):
    job = worker.submit(Event().wait)
    worker.close()
    assert not job.done()


def test_a_thread_that_has_ended_has_computed_nothing(worker):
    """Its processor time cannot be asked for any more; `close` asks while the thread ends."""
    assert worker.result(worker.submit(lambda: 6)) == 6
    thread = worker._thread
    worker.close()
    thread.join()
    assert worker._computed() == 0.0
