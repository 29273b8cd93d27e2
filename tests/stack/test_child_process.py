"""Workers that end, raise, or are suspended: in time, and with the first cause as the reason."""

import os
import resource
import signal
import subprocess
import sys

import numpy as np
import pytest

from stack.child_process import Worker
from stack.errors import WorkerError
from stack.patience import Patience

TARGETS = "tests.stack.worker_targets"
SHORT = 0.2
"""Seconds that take the place of Patience.LONGEST: a suspended process never answers."""


@pytest.fixture
def worker_of(monkeypatch):
    made = []

    def make(target, setup=None, longest=Patience.LONGEST):
        monkeypatch.setattr(Patience, "LONGEST", longest)
        made.append(Worker("the worker", f"{TARGETS}:{target}", setup))
        return made[-1]

    yield make
    for worker in made:
        worker.close()


def test_requests_are_answered_in_their_order(worker_of):
    worker = worker_of("adder", 10)
    for request in range(3):
        worker.send(request)
    assert [worker.receive() for _ in range(3)] == [10, 11, 12]


FAULTS = {
    "raises": ("failing", 0, "the worker failed: ZeroDivisionError: division by zero"),
    "refuses": ("refusing", 7, "the worker failed: 7 is not possible"),
    "cannot be sent": ("unsendable", 0, "the worker failed: .*lambda"),
    "cannot be started": ("bad_start", 0, "the worker failed: ImportError: libworker.so"),
    "does not exist": ("nobody", 0, "the worker failed: AttributeError: .*nobody"),
    "ends": ("exiting", 4, "the worker ended with exit code 4"),
}


@pytest.mark.parametrize(("target", "request_", "reason"), FAULTS.values(), ids=FAULTS)
def test_the_first_cause_is_raised_and_stays_the_reason(worker_of, target, request_, reason):
    """Nothing waits for an answer that never comes: also the next requests fail at once."""
    worker = worker_of(target)
    worker.send(request_)
    with pytest.raises(WorkerError, match=reason) as first:
        worker.receive()
    assert (first.value.refusal != "") == (target == "refusing")
    assert worker.has_answered(1000.0)
    for call in (worker.receive, lambda: worker.send(request_)):
        with pytest.raises(WorkerError) as again:
            call()
        assert again.value is first.value


@pytest.mark.parametrize("error", [None, BlockingIOError(11, "no more processes")])
def test_a_process_that_cannot_be_started_is_named(worker_of, monkeypatch, error):
    """Without an interpreter, and as fork(2) fails with EAGAIN."""

    def fail(*_, **__):
        raise error

    monkeypatch.setattr(sys, "executable", "/nowhere/python")
    if error is not None:
        monkeypatch.setattr(subprocess, "Popen", fail)
    worker = worker_of("adder", 10)
    for call in (lambda: worker.send(0), worker.receive):
        with pytest.raises(WorkerError, match=r"the worker cannot be started: .*\[Errno (2|11)\]"):
            call()


def test_a_killed_process_is_named_with_its_signal(worker_of):
    worker = worker_of("pid_teller")
    worker.send(None)
    os.kill(worker.receive(), signal.SIGKILL)
    worker._process.wait()
    with pytest.raises(WorkerError, match=r"the worker was killed \(SIGKILL\)"):
        worker.send(None)


def test_a_suspended_process_is_given_up(worker_of):
    worker = worker_of("suspending", longest=SHORT)
    worker.send(None)
    with pytest.raises(WorkerError, match=r"the worker gave no answer for 0\.2 s"):
        worker.receive()


def test_naps_count_together(worker_of):
    """The step loop waits in naps, so that operators are served."""
    worker = worker_of("suspending", longest=SHORT)
    worker.send(None)
    stopped = os.waitid(os.P_PID, worker._process.pid, os.WSTOPPED | os.WNOWAIT)
    assert stopped.si_status == signal.SIGSTOP
    naps = 1
    while not worker.has_answered(0.01):
        naps += 1
    assert naps <= 25  # each of about 0.01 s; the first may still count what it has computed
    with pytest.raises(WorkerError, match="gave no answer"):
        worker.receive()


def test_a_process_that_does_not_read_is_given_up(worker_of):
    """A request of 8 MB is longer than what the pipe holds."""
    worker = worker_of("suspending", longest=SHORT)
    worker.send(None)
    with pytest.raises(WorkerError, match="gave no answer"):
        worker.send(np.zeros(1_000_000))


def test_a_process_that_cannot_be_started_is_a_failure(worker_of):
    """No descriptor is left for the pipe; afterwards a closed worker starts as usual."""
    worker = worker_of("adder", 10)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (3, hard))
    try:
        with pytest.raises(WorkerError, match=r"the worker cannot be started: .*open files"):
            worker.send(0)
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    worker.close()
    worker.send(0)
    assert worker.receive() == 10


def test_a_closed_worker_starts_another_process(worker_of):
    worker = worker_of("pid_teller")
    worker.send(None)
    first = worker.receive()
    worker.close()
    worker.send(None)
    assert worker.receive() != first
