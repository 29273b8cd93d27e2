"""Runs of a table in several processes; one that dies or hangs loses only its own run.

`multiprocessing.Pool` waits forever for a run whose process has died. `ProcessPoolExecutor` loses
all runs with it, and cannot be stopped while one is computing.
"""

from __future__ import annotations

import faulthandler
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from time import perf_counter
from typing import Any, TypeVar

E = TypeVar("E")

LONGEST_RUN = 4.0 * 3600.0
"""Wall seconds after which a run counts as hung: far more than the slowest run of a bench takes."""

STDERR = 2
"""File descriptor."""

LONGEST_END = 10.0
"""Wall seconds that a process may take to end."""


@dataclass(frozen=True, slots=True)
class ProcessEnded:
    """What became of a run whose process ended without a result.

    Attributes:
        reason: a sentence.
    """

    reason: str


class _Worker:
    """A process that makes runs, one at a time."""

    def __init__(self, make: Callable[[Any], Any]) -> None:
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self.process: BaseProcess = context.Process(target=_serve, args=(theirs, make), daemon=True)
        self.process.start()
        theirs.close()
        self.entry: Any = None
        self.given, self._due = 0, 0.0

    @property
    def left(self) -> float:
        """Wall seconds until the run counts as hung; 0 afterwards."""
        return max(0.0, self._due - perf_counter())

    def give(self, entry: Any) -> None:
        """Start a run."""
        self.entry, self.given = entry, self.given + 1
        self._due = perf_counter() + LONGEST_RUN
        with suppress(OSError):  # the process has died; `result` says so
            self.connection.send(entry)

    def result(self) -> Any:
        """Return the result of the run, an exception of it, or ProcessEnded."""
        if not self.connection.poll():
            return ProcessEnded(f"hung: no result after {LONGEST_RUN / 3600.0:g} h")
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            self.process.join(LONGEST_END)
            return ProcessEnded(_reason(self.process.exitcode))

    def end(self) -> None:
        """End the process, whatever it does."""
        self.process.kill()
        self.process.join(LONGEST_END)
        self.connection.close()


def results(
    make: Callable[[E], Any], entries: Sequence[E], jobs: int, runs_per_process: int
) -> Iterator[tuple[E, Any]]:
    """Yield entries with what `make` returned for them, in the order in which the runs finish.

    Args:
        make: a function that can be pickled. Instead of its exceptions, which are yielded as well,
            or of a process that ends, nothing is raised.
        entries: arguments.
        jobs: number of processes.
        runs_per_process: a process is replaced after so many runs.
    """
    waiting = list(reversed(entries))
    workers: list[_Worker] = []
    try:
        while waiting or workers:
            while waiting and len(workers) < jobs:
                workers.append(_Worker(make))
                workers[-1].give(waiting.pop())
            wait([worker.connection for worker in workers], min(worker.left for worker in workers))
            for worker in [one for one in workers if one.connection.poll() or not one.left]:
                result = worker.result()
                yield worker.entry, result
                over = isinstance(result, ProcessEnded) or worker.given >= runs_per_process
                if over or not waiting:
                    worker.end()
                    workers.remove(worker)
                else:
                    worker.give(waiting.pop())
    finally:
        for worker in workers:
            worker.end()


@contextmanager
def bounded() -> Iterator[None]:
    """End this process with a traceback if a run in it hangs."""
    faulthandler.dump_traceback_later(LONGEST_RUN, exit=True, file=STDERR)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def _serve(connection: Connection, make: Callable[[Any], Any]) -> None:
    """Make runs until the parent ends."""
    # ctrl+C reaches every process of a terminal: the parent ends its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    while True:
        try:
            entry = connection.recv()
        except EOFError:
            return
        try:
            result = make(entry)
        except Exception as error:
            result = error
        connection.send(result)


def _reason(exit_code: int | None) -> str:
    if exit_code is None:
        return "the process gave no result and did not end"
    if exit_code >= 0:
        return f"the process ended with exit code {exit_code}"
    with suppress(ValueError):
        return f"the process was ended by {signal.Signals(-exit_code).name}"
    return f"the process was ended by signal {-exit_code}"
