"""Pose graph optimisation in a process of its own, with its result at a fixed latency.

gtsam holds Python's interpreter lock for the whole optimisation, up to seconds for large graphs: in
a thread it would stop the control loop. A problem submitted at time t is applied at t + latency on
the robot's clock, however long it took: the loop waits for a late result, so that a simulated run
is the same on every machine. `main` runs in the child process.
"""

from __future__ import annotations

import signal
import subprocess
from multiprocessing.connection import Connection

from stack.child_process import start_child
from stack.errors import BodyError, InputError
from stack.mapping.slam.landmarks import Problem, solve
from stack.mapping.slam.optimiser import Optimum


class OptimiserWorker:
    """Optimises one graph at a time in a child process, started with the first one.

    Attributes:
        waits: whether a late result is waited for; not with a body whose clock goes on.
    """

    def __init__(self, *, waits: bool = True) -> None:
        self.waits = waits
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None
        self._due: float | None = None
        self._early: Optimum | None = None

    @property
    def is_busy(self) -> bool:
        """Whether a result has not been fetched yet."""
        return self._due is not None

    def submit(self, problem: Problem, due: float) -> None:
        """Begin to optimise a graph; its result is due at `due`, seconds on the robot's clock."""
        pipe = self._pipe or self._start()
        try:
            pipe.send(problem)
        except OSError as error:
            raise self._lost() from error
        self._due = due

    def result(self, time: float) -> Optimum | None:
        """Return the optimised graph once it is due; None before.

        Raises:
            InputError: gtsam is not installed.
            BodyError: the process ended.
        """
        if self._due is None or self._pipe is None or time < self._due - 1e-9:
            return None
        try:
            if self._early is None and not (self.waits or self._pipe.poll()):
                return None
        except OSError as error:
            raise self._lost() from error
        found, self._due, self._early = self._early or self._receive(self._pipe), None, None
        return found

    def solve(self, problem: Problem) -> Optimum:
        """Optimise another graph at once and wait for it; a submitted one stays due at its time.

        Raises:
            InputError: gtsam is not installed.
            BodyError: the process ended.
        """
        pipe = self._pipe or self._start()
        if self._due is not None and self._early is None:
            self._early = self._receive(pipe)
        try:
            pipe.send(problem)
        except OSError as error:
            raise self._lost() from error
        return self._receive(pipe)

    def close(self) -> None:
        """Close the pipe and end the process. Safe to call twice."""
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._pipe = self._process = self._due = self._early = None

    def _receive(self, pipe: Connection) -> Optimum:
        try:
            answer: Optimum | str = pipe.recv()
        except (EOFError, OSError) as error:
            raise self._lost() from error
        if isinstance(answer, str):
            raise InputError(answer)
        return answer

    def _start(self) -> Connection:
        self._process, self._pipe = start_child("stack.mapping.slam.worker")
        return self._pipe

    def _lost(self) -> BodyError:
        code = None if self._process is None else self._process.poll()
        return BodyError(f"the pose graph optimiser ended unexpectedly (exit code {code})")


def main(descriptor: int) -> None:
    """Optimise graphs until the other end of the pipe closes."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the engine handles Ctrl-C and closes the pipe
    with Connection(descriptor) as pipe:
        try:
            while True:
                problem: Problem = pipe.recv()
                try:
                    pipe.send(solve(problem))
                except InputError as error:
                    pipe.send(str(error))
        except (EOFError, ConnectionResetError, BrokenPipeError):
            return
