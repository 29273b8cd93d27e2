"""Pose graph optimisation in a process of its own, with its result at a fixed latency.

gtsam holds Python's interpreter lock for the whole optimisation, up to seconds for large graphs: in
a thread it would stop the control loop. A problem submitted at time t is applied at t + latency on
the robot's clock, however long it took: the loop waits for a late result, so that a simulated run
is the same on every machine.
"""

from __future__ import annotations

from collections.abc import Callable

from stack.child_process import Worker
from stack.errors import WorkerError
from stack.mapping.slam.landmarks import Problem, solve
from stack.mapping.slam.optimiser import Optimum
from stack.patience import Patience

NAME = "the pose graph optimiser"


class OptimiserWorker:
    """Optimises one graph at a time in a child process, started with the first one.

    Attributes:
        waits: whether a late result is waited for; not with a body whose clock goes on.
    """

    def __init__(self, *, waits: bool = True) -> None:
        self.waits = waits
        self._worker = Worker(NAME, f"{__name__}:optimiser")
        self._due: float | None = None
        self._early: Optimum | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a result has not been fetched yet."""
        return self._due is not None

    def submit(self, problem: Problem, due: float) -> None:
        """Begin to optimise a graph; its result is due at `due`, seconds on the robot's clock.

        Raises:
            WorkerError: the process failed.
        """
        self._worker.send(problem)
        self._due = due

    def await_result(self, time: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds; return whether `result` returns at once."""
        if self._early is not None or not self.waits or not self._is_due(time):
            return True
        return self._worker.has_answered(longest)

    def result(self, time: float) -> Optimum | None:
        """Return the optimised graph once it is due; None before.

        Raises:
            WorkerError: the process failed.
        """
        if self._due is None or not self._is_due(time):
            return None
        if self._early is None and not (self.waits or self._worker.has_answered(0.0)):
            if Patience.is_over(self._due, time):
                raise WorkerError(f"{NAME} gave no answer for {Patience.LONGEST:g} s")
            return None
        found, self._early = self._early or self._receive(), None
        self._due = None
        return found

    def solve(self, problem: Problem) -> Optimum:
        """Optimise another graph at once and wait for it; a submitted one stays due at its time.

        Raises:
            WorkerError: the process failed.
        """
        if self._due is not None and self._early is None:
            self._early = self._receive()
        self._worker.send(problem)
        return self._receive()

    def close(self) -> None:
        """End the process. Safe to call twice."""
        self._worker.close()
        self._due = self._early = None

    def _is_due(self, time: float) -> bool:
        return self._due is not None and time >= self._due - 1e-9

    def _receive(self) -> Optimum:
        optimum: Optimum = self._worker.receive()
        return optimum


def optimiser(_: None) -> Callable[[Problem], Optimum]:
    """Return what answers requests in the child process."""
    return solve
