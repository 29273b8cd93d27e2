"""Jobs beside the control loop: one worker thread, results at a fixed latency.

A job that is asked for at time t gives its result at t + latency on the robot's clock, however long
it took to compute: the loop waits for a late one. A simulated run is therefore the same on every
machine. On hardware a result is used when it comes.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from stack.errors import NavigationError, WorkerError, exception_sentence, traceback_text
from stack.patience import Patience
from stack.types import Failure, FailureCode
from stack.worker_thread import WorkerThread

T = TypeVar("T")


@dataclass(frozen=True)
class Deferral:
    """How results of a worker are waited for.

    Attributes:
        name: of the worker in sentences: `the planner`.
        worker: does the jobs.
        waits: whether a late result is waited for; on hardware it is not.
        log: receives tracebacks.
    """

    name: str
    worker: WorkerThread
    waits: bool
    log: Callable[[str], None]


class Deferred(Generic[T]):
    """Handle of a job.

    Args:
        job: submitted to the worker.
        due: time from which the result is used, seconds on the robot's clock.
        deferral: how it is waited for.
    """

    def __init__(self, job: Future[T], due: float, deferral: Deferral) -> None:
        self._future, self._due, self._deferral = job, due, deferral
        self._dropped = False

    @property
    def over(self) -> bool:
        """Whether the job has ended."""
        return self._future.done()

    def is_late(self, time: float) -> bool:
        """Whether `result` would wait at this time, robot's clock."""
        waits = self._deferral.waits and not self._dropped and not self._future.done()
        return waits and time >= self._due - 1e-9

    def drop(self) -> None:
        """Cancel the job; one that runs goes on, and its result is not used."""
        self._dropped = True
        self._future.cancel()

    def join(self, longest: float) -> bool:
        """Wait at most `longest` wall seconds; return whether `result` returns at once."""
        return self._deferral.worker.await_job(self._future, longest)

    def result(self, time: float) -> T | Failure | None:
        """Return the result or the failure; None before it is due."""
        if time < self._due - 1e-9:
            return None
        worker, name = self._deferral.worker, self._deferral.name
        try:
            if not (self._deferral.waits or self._future.done()):
                if Patience.is_over(self._due, time):
                    raise worker.silence
                return None
            return worker.result(self._future)
        except CancelledError:
            return Failure(FailureCode.CANCELLED, "the plan was cancelled")
        except NavigationError as error:
            return error.failure
        except WorkerError as error:
            self.drop()
            return Failure(FailureCode.EXCEPTION, str(error))
        except Exception as error:  # a planner may be a plugin
            what = f"{name} raised an exception"
            self._deferral.log(traceback_text(what, error))
            return Failure(FailureCode.EXCEPTION, f"{what}: {exception_sentence(error)}")


D = TypeVar("D", bound=Deferred[Any])


class DeferringWorker:
    """Does jobs one at a time in its own thread.

    Args:
        name: in sentences: `the planner`.
        log: receives tracebacks.
        is_real_time: a late result is not waited for.
    """

    def __init__(self, name: str, log: Callable[[str], None], *, is_real_time: bool) -> None:
        self.deferral = Deferral(name, WorkerThread(name), not is_real_time, log)
        self._open: list[Deferred[Any]] = []

    def keep(self, item: D) -> D:
        """Wait for this job, too."""
        self._open = [other for other in self._open if not other.over] + [item]
        return item

    def await_results(self, time: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds for results that are due.

        Args:
            time: robot's clock, seconds.
            longest: wall seconds.

        Returns:
            Whether there is no late one: `Deferred.result` returns at once.
        """
        late = [item for item in self._open if item.is_late(time)]
        if late:
            late[0].join(longest)
        return all(item.join(0.0) for item in late)

    def close(self) -> None:
        """Cancel all jobs and stop the worker."""
        for item in self._open:
            item.drop()
        self.deferral.worker.close()
