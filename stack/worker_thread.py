"""A thread that works for this one: one job after another, with a limit."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, wait
from queue import SimpleQueue
from threading import Thread, get_ident
from time import (
    clock_gettime,
    monotonic,  # noqa: TID251 - only how long another thread is waited for
    pthread_getcpuclockid,
)
from typing import Any, TypeVar

from stack.errors import WorkerError
from stack.patience import Patience

T = TypeVar("T")


class WorkerThread:
    """A thread that does jobs in their order, started with the first one.

    Unlike that of a ThreadPoolExecutor it does not keep the process from ending while a job hangs.
    A job is waited for with `Patience`. When that is over, this job and all later ones are given
    up, until the one that hangs has ended.

    Args:
        name: in sentences: `the planner`.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = SimpleQueue()
        self._thread: Thread | None = None
        self._clock: int | None = None
        self._done = self._counted = 0
        self._patience = Patience(self._computed)

    def submit(self, job: Callable[[], T]) -> Future[T]:
        """Do a job after those that were submitted before."""
        if self._thread is None:
            self._thread = Thread(target=self._work, name=self._name, daemon=True)
            self._thread.start()
        future: Future[T] = Future()
        self._jobs.put((future, job))
        return future

    def await_job(self, job: Future[Any], longest: float) -> bool:
        """Wait at most `longest` wall seconds; return whether `result` does not wait."""
        if job.done() or not self._left:
            return True
        began = monotonic()
        wait([job], longest)
        # Not the time in which this process is suspended.
        self._patience.spend(min(longest, monotonic() - began))
        return job.done() or not self._left

    def result(self, job: Future[T]) -> T:
        """Wait for a job and return its result, or raise its exception.

        Raises:
            CancelledError: it was cancelled before it began.
            WorkerError: it does not end.
        """
        while not self.await_job(job, Patience.LONGEST):
            pass
        if not job.done():
            raise self.silence
        return job.result()

    @property
    def silence(self) -> WorkerError:
        """The error that a job does not end."""
        return WorkerError(f"{self._name} gave no result for {Patience.LONGEST:g} s")

    def close(self) -> None:
        """Let the thread end after the jobs that it has; do not wait for one that hangs."""
        if self._thread is not None:
            self._jobs.put(None)
            self._thread.join(self._left)
        self._thread = None

    @property
    def _left(self) -> float:
        """Seconds for which the job that is being done is still waited for at least."""
        if self._counted != self._done:  # another job than at the last look
            self._counted = self._done
            self._patience.begin()
        return self._patience.left

    def _computed(self) -> float:
        """Processor time of the thread, seconds; 0 before it begins and after it has ended."""
        clock = self._clock
        try:
            return 0.0 if clock is None else clock_gettime(clock)
        except OSError:
            return 0.0

    def _work(self) -> None:
        self._clock = pthread_getcpuclockid(get_ident())  # asked for here: this thread lives
        while (item := self._jobs.get()) is not None:
            future, job = item
            if not future.set_running_or_notify_cancel():
                continue
            try:
                result = job()
            except BaseException as error:
                future.set_exception(error)
            else:
                future.set_result(result)
            self._done += 1
        self._clock = None
