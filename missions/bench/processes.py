"""Runs in several long-lived processes; one that dies or hangs loses only its own run.

The processes end with this one, however that ends: the system kills them (prctl(2), PDEATHSIG).

`multiprocessing.Pool` waits forever for a run whose process has died. `ProcessPoolExecutor` loses
all runs with it, and cannot be stopped while one is computing.
"""

from __future__ import annotations

import ctypes
import faulthandler
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from time import perf_counter
from typing import Any, TypeVar

from stack.patience import Patience, processor_time

E = TypeVar("E")

Alive = Callable[[], None]
"""What a run calls after each step that makes progress."""

Start = Callable[[Alive], Callable[[E], Any]]
"""Called once in each process, with what reports progress; returns what makes the runs.
It can be pickled."""

LONGEST_RUN = 4.0 * 3600.0
"""Seconds after which a run counts as hung: far more than the slowest run of a bench takes."""

STDERR = 2
"""File descriptor."""

LONGEST_END = 10.0
"""Wall seconds that a process may take to end."""

POLL_PERIOD = 2.0
"""Wall seconds between two polls of the processes."""

PR_SET_PDEATHSIG = 1
"""Of prctl(2): the signal that a process gets when its parent ends."""


@dataclass(frozen=True, slots=True)
class ProcessEnded:
    """What became of a run whose process ended without a result.

    Attributes:
        reason: a sentence.
        hung: whether it was ended because the run made no progress.
        killed: whether somebody else killed it, such as the system for want of memory.
    """

    reason: str
    hung: bool = False
    killed: bool = False


class _Worker:
    """A process that makes runs, one at a time."""

    def __init__(self, start: Start[Any], silence: float) -> None:
        context = get_context("spawn")
        self.connection, theirs = context.Pipe()
        self._silence, self._progress = silence, context.RawValue("L", 0)
        arguments = theirs, start, self._progress, os.getpid()
        self.process: BaseProcess = context.Process(target=_serve, args=arguments, daemon=True)
        self.process.start()
        theirs.close()
        self.entry: Any = None
        self.given, self._noted = 0, 0
        process = self.process.pid or 0
        self._patience = Patience(lambda: processor_time(process), silence)

    @property
    def left(self) -> float:
        """Seconds until the run counts as hung; 0 afterwards."""
        return self._patience.left

    def note_progress(self, waited: float) -> None:
        """Count wall seconds in which the run may have made progress."""
        if self._progress.value == self._noted:
            self._patience.spend(waited)
            return
        self._noted = self._progress.value
        self._patience.begin()

    def give(self, entry: Any) -> None:
        """Start a run."""
        self.entry, self.given = entry, self.given + 1
        self._patience.begin()
        with suppress(OSError):  # the process has died; `result` says so
            self.connection.send(entry)

    def result(self) -> Any:
        """Return the result of the run, an exception of it, or ProcessEnded."""
        if not self.connection.poll():
            return ProcessEnded(f"hung: {_silent_for(self._silence)}", hung=True)
        try:
            return self.connection.recv()
        except (EOFError, OSError):
            self.process.join(LONGEST_END)
            code = self.process.exitcode
            return ProcessEnded(_reason(code), killed=code == -signal.SIGKILL)

    def end(self) -> None:
        """End the process, whatever it does."""
        self.process.kill()
        self.process.join(LONGEST_END)
        self.connection.close()


def results(  # noqa: PLR0913 - the optional ones by keyword
    start: Start[E], entries: Iterable[E], jobs: int, runs_per_process: int, *,
    silence: float | None = None, on_poll: Callable[[], None] = lambda: None,
) -> Iterator[tuple[E, Any]]:  # fmt: skip
    """Yield entries with what was made of them, in the order in which the runs finish.

    Exceptions of a run are yielded as well, and ProcessEnded instead of what a process that has
    ended or hangs would have made.

    Args:
        start: of each process.
        entries: arguments. Each is taken when a process is free, after the results so far.
        jobs: number of processes.
        runs_per_process: a process is replaced after so many runs.
        silence: seconds that a run may compute, or do nothing, since it began or was alive; then it
            counts as hung. None: LONGEST_RUN.
        on_poll: called every POLL_PERIOD seconds.
    """
    waiting = iter(entries)
    silence = LONGEST_RUN if silence is None else silence
    workers: list[_Worker] = []

    def employed(worker: _Worker) -> bool:
        for entry in islice(waiting, 1):
            worker.give(entry)
            return True
        return False

    try:
        while True:
            while len(workers) < jobs and (following := [*islice(waiting, 1)]):
                workers.append(_Worker(start, silence))
                workers[-1].give(following[0])
            if not workers:
                return
            began, left = perf_counter(), min(worker.left for worker in workers)
            wait([worker.connection for worker in workers], min(left, POLL_PERIOD))
            waited = min(POLL_PERIOD, perf_counter() - began)  # without the time of Ctrl-Z
            for worker in workers:
                worker.note_progress(waited)
            on_poll()
            for worker in [one for one in workers if one.connection.poll() or not one.left]:
                entry, result = worker.entry, worker.result()
                yield entry, result  # what it tells may decide about the next entry
                over = isinstance(result, ProcessEnded) or worker.given >= runs_per_process
                if over or not employed(worker):
                    worker.end()
                    workers.remove(worker)
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


def _serve(
    connection: Connection, start: Start[Any], progress: ctypes.c_ulong, parent: int
) -> None:
    """Make runs until the parent ends."""
    # ctrl+C reaches every process of a terminal: the parent ends its workers
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if os.getppid() != parent:
        return

    def alive() -> None:
        progress.value += 1

    make = start(alive)
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


def _silent_for(seconds: float) -> str:
    if seconds >= 3600.0:
        return f"no result after {seconds / 3600.0:g} h"
    return f"no progress for {seconds:g} s"


def _reason(exit_code: int | None) -> str:
    if exit_code is None:
        return "the process gave no result and did not end"
    if exit_code >= 0:
        return f"the process ended with exit code {exit_code}"
    with suppress(ValueError):
        return f"the process was ended by {signal.Signals(-exit_code).name}"
    return f"the process was ended by signal {-exit_code}"
