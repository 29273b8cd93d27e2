"""Pose graph optimisation in a process of its own, with its result at a fixed latency.

gtsam holds Python's interpreter lock for the whole optimisation, up to seconds for large graphs: in
a thread it would stop the control loop. A problem submitted at time t is applied at t + latency on
the robot's clock, however long it took: the loop waits for a late result, so that a simulated run
is the same on every machine. A thread talks to the process, so that no step waits for the pipe.

The process keeps the graph and gets its changes. When it fails, mapping goes on without it for a
while; then another process gets the whole graph.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future, wait
from dataclasses import dataclass, replace

from stack.child_process import Worker
from stack.errors import WorkerError
from stack.mapping.slam.graph import Edge
from stack.mapping.slam.landmarks import Problem, solve
from stack.mapping.slam.optimiser import GraphOptimiser, Optimum
from stack.patience import Patience
from stack.worker_thread import WorkerThread

NAME = "the pose graph optimiser"

PAUSE, LONGEST_PAUSE = 5.0, 60.0
"""Seconds on the robot's clock from a failure to the next process: twice as many after each failure
in a row, up to the longest."""

SUSPENDED = 2.0
"""Wall seconds after which a process is given up that a signal has stopped."""

NAP = 0.1
"""Wall seconds between two looks at the process."""


class OptimiserWorker:
    """Optimises one graph at a time in a child process, started with the first one.

    Attributes:
        waits: whether a late result is waited for; not with a body whose clock goes on.
        fault: why there is no process that works; empty if there is one.
    """

    def __init__(self, *, waits: bool = True) -> None:
        self.waits, self.fault = waits, ""
        self._worker, self._thread = Worker(NAME, f"{__name__}:optimiser"), WorkerThread(NAME)
        self._known = _KnownEdges()
        self._job: Future[Optimum] | None = None
        self._due = self._free_at = self._suspended = 0.0
        self._losses = 0

    def is_free(self, time: float) -> bool:
        """Whether a graph can be submitted: the last result was fetched, and no pause lasts."""
        return self._job is None and time >= self._free_at

    def submit(self, problem: Problem, due: float) -> None:
        """Begin to optimise a graph; its result is due at `due`, seconds on the robot's clock."""
        self._job, self._due = self._ask(problem), due

    def await_result(self, time: float, longest: float) -> bool:
        """Wait at most `longest` wall seconds; return whether `result` returns at once."""
        if self._job is None or not self.waits or not self._is_due(time):
            return True
        return self._has_ended(self._job, longest)

    def result(self, time: float) -> Optimum | None:
        """Return the optimised graph once it is due; None before.

        Raises:
            WorkerError: the process failed. The graph has to be submitted again, once `is_free`.
        """
        if self._job is None or not self._is_due(time):
            return None
        if not (self.waits or self._job.done()):
            if not Patience.is_over(self._due, time):
                return None
            self._worker.kill(f"gave no answer for {Patience.LONGEST:g} s")
        job, self._job = self._job, None
        try:
            found = self._outcome(job)
        except WorkerError as error:
            pause = min(LONGEST_PAUSE, PAUSE * 2.0**self._losses)
            self._losses, self._free_at, self.fault = self._losses + 1, time + pause, str(error)
            self._restart()
            raise WorkerError(
                f"{error}; the map grows on without corrections, and another process starts in"
                f" {pause:g} s"
            ) from error
        self._losses, self.fault = 0, ""
        return found

    def solve(self, problem: Problem) -> Optimum:
        """Optimise another graph at once and wait for it; a submitted one stays due at its time.

        Raises:
            WorkerError: the process failed, and another one too.
        """
        try:
            return self._outcome(self._ask(problem))
        except WorkerError:
            self._restart()
        return self._outcome(self._ask(problem))

    def close(self) -> None:
        """End the process. Safe to call twice."""
        self._worker.kill("was closed")
        self._thread.close()
        self._restart()
        self._job = None

    def _is_due(self, time: float) -> bool:
        return time >= self._due - 1e-9

    def _ask(self, problem: Problem) -> Future[Optimum]:
        """Send what is new of a graph, after the requests before."""
        worker, change = self._worker, self._known.change_to(problem)

        def answered() -> Optimum:
            worker.send(change)
            optimum: Optimum = worker.receive()
            return optimum

        return self._thread.submit(answered)

    def _has_ended(self, job: Future[Optimum], longest: float) -> bool:
        """Wait at most `longest` wall seconds for an answer or a failure."""
        wait([job], longest)
        if job.done():
            return True
        self._suspended = self._suspended + longest if self._worker.is_suspended else 0.0
        if self._suspended > SUSPENDED:
            self._worker.kill("is suspended by a signal (SIGSTOP)")
        return False

    def _outcome(self, job: Future[Optimum]) -> Optimum:
        while not self._has_ended(job, NAP):
            pass
        self._suspended = 0.0
        return job.result()

    def _restart(self) -> None:
        """Let the next graph start another process, which gets all of it."""
        self._worker.close()
        self._known = _KnownEdges()


@dataclass(frozen=True, slots=True)
class Change:
    """What makes the graph that the process knows the one to optimise.

    Attributes:
        problem: the graph, with those of its edges that the process does not know.
        first: number of the first of these; the others have the numbers after it.
        removed: numbers of the edges that are no longer in the graph.
    """

    problem: Problem
    first: int
    removed: tuple[int, ...]


class _KnownEdges:
    """Edges that a process knows, by number: the same object is the same edge."""

    def __init__(self) -> None:
        self._numbers: dict[int, tuple[int, Edge]] = {}
        self._next = 0

    def change_to(self, problem: Problem) -> Change:
        """Return the change to a graph, which may change while the process gets it."""
        before, first = self._numbers, self._next
        self._numbers, new = {}, []
        for edge in problem.edges:
            known = before.pop(id(edge), None)
            if known is None:
                known, self._next = (self._next, edge), self._next + 1
                new.append(edge)
            self._numbers[id(edge)] = known
        landmarks = {
            node: replace(one, sightings=dict(one.sightings))
            for node, one in problem.landmarks.items()
        }
        removed = tuple(number for number, _ in before.values())
        return Change(replace(problem, edges=new, landmarks=landmarks), first, removed)


def optimiser(_: None) -> Callable[[Change], Optimum]:
    """Return what answers requests in the child process."""
    edges: dict[int, Edge] = {}
    kept = GraphOptimiser()

    def answer(change: Change) -> Optimum:
        for number in change.removed:
            del edges[number]
        edges.update(enumerate(change.problem.edges, change.first))
        return solve(replace(change.problem, edges=list(edges.values())), kept)

    return answer
