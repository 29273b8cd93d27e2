"""A thread that works for this one: one job after another, with a limit."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, wait
from queue import SimpleQueue
from threading import Thread
from time import monotonic  # noqa: TID251 - only how long another thread is waited for
from typing import Any, TypeVar

from stack.child_process import LONGEST_WAIT
from stack.errors import WorkerError

T = TypeVar("T")


class WorkerThread:
    """A thread that does jobs in their order, started with the first one.

    Unlike that of a ThreadPoolExecutor it does not keep the process from ending while a job hangs.
    A job is waited for at most LONGEST_WAIT. Then this job and all later ones are given up, until
    the one that hangs has ended.

    Args:
        name: in sentences: `the planner`.
    """

    def __init__(self, name: str) -> None:
        self._name = name
        self._jobs: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = SimpleQueue()
        self._thread: Thread | None = None
        self._done = 0
        self._waited = 0, 0.0

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
        if job.done() or self._patience <= 0.0:
            return True
        done, began = self._done, monotonic()
        wait([job], longest)
        spent = min(longest, monotonic() - began)  # not the time while this process is suspended
        before = self._waited[1] if self._waited[0] == done else 0.0
        self._waited = done, before + spent
        return job.done() or self._patience <= 0.0

    def result(self, job: Future[T]) -> T:
        """Wait for a job and return its result, or raise its exception.

        Raises:
            CancelledError: it was cancelled before it began.
            WorkerError: it does not end.
        """
        self.await_job(job, LONGEST_WAIT)
        if not job.done():
            raise self.silence
        return job.result()

    @property
    def silence(self) -> WorkerError:
        """The error that a job does not end."""
        return WorkerError(f"{self._name} gave no result for {LONGEST_WAIT:g} s")

    def close(self) -> None:
        """Let the thread end after the jobs that it has; do not wait for one that hangs."""
        if self._thread is not None:
            self._jobs.put(None)
            self._thread.join(max(0.0, self._patience))
        self._thread = None

    @property
    def _patience(self) -> float:
        """Wall seconds that the job which is being done is still waited for."""
        done, waited = self._waited
        return LONGEST_WAIT - waited if done == self._done else LONGEST_WAIT

    def _work(self) -> None:
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
