"""Child processes that work for this one: requests and answers through a pipe, with a limit."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from time import monotonic  # noqa: TID251 - only how long another process is waited for
from typing import Any

from stack.errors import TreepilotError, WorkerError, exception_sentence
from stack.patience import Patience, process_state, processor_time

ENDS_WITHIN = 1.0
"""Wall seconds that a process may take to end after it has closed its end of the pipe."""


class Worker:
    """A child process that answers one request after another. The first one starts it.

    An answer is waited for with `Patience`. After a failure all calls raise it again, until `close`
    is called; the next request then starts another process.

    Args:
        name: in sentences: `the pose graph optimiser`.
        target: `module:function`. The child calls the function with the setup; what it returns is
            called with each request, and returns the answer.
        setup: can be pickled.
    """

    def __init__(self, name: str, target: str, setup: Any = None) -> None:
        self._name, self._target, self._setup = name, target, setup
        self._process: subprocess.Popen[bytes] | None = None
        self._pipe: Connection | None = None
        self._patience = Patience(self._computed)
        self._failure: WorkerError | None = None
        self._killed = ""

    def send(self, request: Any) -> None:
        """Send a request; start the process with the first one.

        Raises:
            WorkerError: the process cannot be started, has ended, or does not read.
        """
        if self._failure is not None:
            raise self._failure
        try:
            if self._pipe is None:
                self._process, self._pipe = _start_child()
                if self._killed:
                    raise BrokenPipeError
                self._pipe.send((self._target, self._setup))
            self._patience.begin()
            self._pipe.send(request)
        except OSError as error:
            raise self._lost(error) from error

    def has_answered(self, longest: float) -> bool:
        """Wait at most `longest` wall seconds; return whether `receive` returns or raises at once.

        True also without a process.
        """
        if self._pipe is None:
            return True
        began = monotonic()
        try:
            answered = self._pipe.poll(longest)
        except OSError:
            return True  # `receive` reports the failure
        # Not the time in which this process is suspended.
        self._patience.spend(min(longest, monotonic() - began))
        return answered or not self._patience.left

    def receive(self) -> Any:
        """Wait for the answer to the oldest request and return it.

        Raises:
            WorkerError: the process has ended, raised an exception or does not answer.
        """
        if self._failure is not None:
            raise self._failure
        assert self._pipe is not None, "nothing was sent"
        while not self.has_answered(Patience.LONGEST):
            pass
        try:
            if not self._patience.left and not self._pipe.poll():
                raise BlockingIOError
            answer = self._pipe.recv()
        except (EOFError, OSError) as error:
            raise self._lost(error) from error
        self._patience.begin()
        if isinstance(answer, _Raised):
            raise self._fail(WorkerError(f"{self._name} failed: {answer.sentence}", answer.refusal))
        return answer

    @property
    def is_suspended(self) -> bool:
        """Whether a signal has stopped the process: it does nothing until another one comes."""
        return self._process is not None and process_state(self._process.pid)[0] == "T"

    def kill(self, why: str) -> None:
        """End the process while another thread waits for its answer; that fails with a reason.

        Args:
            why: after the name of the worker: `is suspended`.
        """
        self._killed = why
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """Close the pipe and end the process, whatever it does. Safe to call twice."""
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._pipe = self._process = self._failure = None
        self._killed = ""

    def _computed(self) -> float:
        """Processor time of the process, seconds."""
        return 0.0 if self._process is None else processor_time(self._process.pid)

    def _lost(self, error: Exception) -> WorkerError:
        """Return what became of the process."""
        if self._process is None:
            return self._fail(
                WorkerError(f"{self._name} cannot be started: {exception_sentence(error)}")
            )
        if isinstance(error, BlockingIOError):
            return self._fail(
                WorkerError(f"{self._name} gave no answer for {Patience.LONGEST:g} s")
            )
        try:
            code = self._process.wait(ENDS_WITHIN)
        except subprocess.TimeoutExpired:
            return self._fail(WorkerError(f"{self._name} no longer answers"))
        if self._killed:
            return self._fail(WorkerError(f"{self._name} {self._killed}"))
        how = f"was killed ({_signal_name(-code)})" if code < 0 else f"ended with exit code {code}"
        return self._fail(WorkerError(f"{self._name} {how}"))

    def _fail(self, failure: WorkerError) -> WorkerError:
        self.close()
        self._failure = failure
        return failure


@dataclass(frozen=True, slots=True)
class _Raised:
    """Takes the place of an answer.

    Attributes:
        sentence: about the exception.
        refusal: the sentence if it is an error of treepilot; else empty.
    """

    sentence: str
    refusal: str = ""


def _start_child() -> tuple[subprocess.Popen[bytes], Connection]:
    """Start a bare interpreter that runs `serve`; return it and our pipe.

    multiprocessing's spawn would run the caller's script again unless it is guarded by
    `if __name__ == "__main__"`. The child has its own process group, so Ctrl-C does not reach it.
    Its end of the pipe closes with ours, however this process ends; `serve` returns then.
    """
    ours, theirs = Pipe()
    _limit(ours, Patience.LONGEST)
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; "
        f"from {__name__} import serve; serve({theirs.fileno()})"
    )
    with theirs:
        process = subprocess.Popen(
            [sys.executable, "-c", code],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            pass_fds=[theirs.fileno()],
            process_group=0,
        )
    return process, ours


def serve(descriptor: int) -> None:
    """Answer the requests of a `Worker` until its end of the pipe closes: the child's part."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the engine handles Ctrl-C and closes the pipe
    with Connection(descriptor) as pipe:
        try:
            answer = _caught(_answering, pipe.recv_bytes())
            while True:
                request = pipe.recv_bytes()
                # After a failed start the process goes on, else its reason would be lost with it.
                failed = isinstance(answer, _Raised)
                reply = answer if failed else _caught(_packed_answer, answer, request)
                pipe.send_bytes(reply if isinstance(reply, bytes) else ForkingPickler.dumps(reply))
        except (EOFError, ConnectionResetError, BrokenPipeError):
            return


def _answering(start: bytes) -> Any:
    """Return the function of a target that answers requests."""
    target, setup = ForkingPickler.loads(start)
    module, _, function = target.partition(":")
    return getattr(import_module(module), function)(setup)


def _packed_answer(answer: Callable[[Any], Any], request: bytes) -> bytes:
    return bytes(ForkingPickler.dumps(answer(ForkingPickler.loads(request))))


def _caught(call: Callable[..., Any], *arguments: Any) -> Any:
    """Return the result of a call, or what it raised."""
    try:
        return call(*arguments)
    except TreepilotError as error:
        return _Raised(str(error), str(error))
    except Exception as error:
        traceback.print_exc()
        return _Raised(exception_sentence(error))


def run_module(module: str, *arguments: str, longest: float) -> subprocess.CompletedProcess[bytes]:
    """Run a module as a program to its end, and keep what it prints.

    Raises:
        subprocess.TimeoutExpired: it did not end within `longest` wall seconds; it was killed.
    """
    path = os.pathsep.join(place or os.getcwd() for place in sys.path)
    return subprocess.run(
        [sys.executable, "-m", module, *arguments],
        capture_output=True, timeout=longest, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip


def _limit(pipe: Connection, seconds: float) -> None:
    """Let reads and writes fail that make no progress: the other process may be suspended."""
    with socket.socket(fileno=os.dup(pipe.fileno())) as end:
        whole = int(seconds)
        limit = struct.pack("@ll", whole, int((seconds - whole) * 1e6))
        for direction in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
            end.setsockopt(socket.SOL_SOCKET, direction, limit)


def _signal_name(number: int) -> str:
    with suppress(ValueError):
        return signal.Signals(number).name
    return f"signal {number}"
