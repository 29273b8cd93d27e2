"""The supervising process: starts the engine, owns terminal and signals, prints the result.

It imports nothing heavy and starts the engine first. All watchdogs on wall time are here.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread
from time import monotonic, sleep  # noqa: TID251 - waiting for another process
from typing import IO, Any

from missions.execution.supervision.child_process import command_of
from missions.execution.supervision.heartbeat import Beat, Heartbeat, Phase, Request
from missions.execution.supervision.messages import Inbox

Engine = subprocess.Popen[bytes]

POLL = 0.03
"""Wall seconds between two looks at the engine."""

STOP_WITHIN = 2.0
"""Wall seconds after a signal in which the engine must end; then it is killed."""

CLOSE_WITHIN = 10.0
"""Wall seconds that an engine which has stopped the robot gets to write its records."""

SLOW_UPDATE = 0.5
"""Wall seconds after which a node that has not returned is reported as slow."""

SILENT_AFTER = 2.0
"""Wall seconds without a step after which the engine is reported as hung."""

STACKS_WITHIN = 0.1
"""Wall seconds that an engine gets to write the stacks of its threads before it is killed."""

NOWHERE: tuple[int, tuple[int, ...]] = (-1, ())


class Supervisor:
    """Supervises one engine.

    Attributes:
        engine: the child process.
        drafts: of the reports of the missions, by run folder.
        endings: how missions have ended, state and reason, by run folder.
        started: the messages of the engine that a mission is ready: its folder, the handle of its
            telemetry, and a draft of its report.
        began: when the engine was started, monotonic.
        reports: of the missions, once the engine has sent them.
        output: copies what the engine writes to standard error.
        killed: why the supervisor killed the engine; empty if it did not.
        signalled: a signal asked for the end.
        stopping: when a signal asked for the end, monotonic; 0 before.
        hung_up: the terminal is gone, and the mission continues without this process.
    """

    def __init__(
        self, request: Mapping[str, Any], hang_timeout: float, caught: deque[int] | None = None, *,
        show: bool,
    ) -> None:  # fmt: skip
        """Start the engine.

        Args:
            request: missions and options, for the engine.
            hang_timeout: wall seconds without a step after which the engine is killed; 0: never.
            caught: signals that were received, for `poll` to act upon.
            show: copy what the engine writes to standard error.
        """
        self._heartbeat, shared = Heartbeat.create()
        ours, theirs = os.pipe()
        self._inbox, self._inbox_end = Inbox(ours), ours
        self._file = os.fdopen(os.memfd_create("output"), "w+b")
        self._hang_timeout, self._on_hangup = hang_timeout, request["on_hangup"]
        message = {
            **request, "heartbeat": shared, "outbox": theirs, "supervisor": os.getpid(),
        }  # fmt: skip
        self.engine = _spawn(message, self._file, (shared, theirs))
        for descriptor in (shared, theirs):
            os.close(descriptor)
        self.output = OutputCopier(self._file, show=show)
        self.output.start()
        self.drafts: dict[str, dict[str, Any]] = {}
        self.endings: dict[str, str] = {}
        self.started: list[dict[str, Any]] = []
        self.began = monotonic()
        self.reports: list[dict[str, Any]] = []
        self.killed, self.stopping, self.hung_up = "", 0.0, False
        self._caught = deque() if caught is None else caught
        self.signalled = False
        self.slow: dict[str, float] = {}
        self._seen = (NOWHERE, 0.0)
        self._is_silent, self._resumed, self._suspended = False, 0.0, 0.0
        self._reported = self._closing = 0.0

    def poll(self) -> bool:
        """Look at the engine once: signals, messages, watchdogs; return whether it still runs."""
        while self._caught:
            self._act_on(self._caught.popleft())
        ended = self.engine.poll() is not None
        for message in self._inbox.receive():
            if message["kind"] in ("prepared", "started"):
                self.drafts[message["folder"]] = message["draft"]
            if message["kind"] == "started":
                self.started.append(message)
            elif message["kind"] == "ended":
                self.endings[message["folder"]] = message["how"]
            elif message["kind"] == "reports":
                self.reports, self._reported = message["reports"], monotonic()
        if ended:
            return False
        self._watch_progress()
        self._watch_end()
        return True

    def wait(self, until: Callable[[], bool] = lambda: False) -> None:
        """Look at the engine until it ends, the terminal is gone, or a condition holds."""
        while self.poll() and not self.hung_up and not until():
            sleep(POLL)

    def interrupt(self) -> None:
        """Ask the engine to end; the second time, kill it."""
        self.signalled = True
        if self.engine.poll() is not None:
            return
        if self.stopping:
            self._kill("the signal came twice")
            return
        self.stopping = monotonic()
        if self._heartbeat.phase is Phase.STARTING:
            self._kill("it had not started yet")
        else:
            self.engine.send_signal(signal.SIGINT)

    def _act_on(self, number: int) -> None:
        if number == signal.SIGHUP:
            self.hang_up()
        elif number == signal.SIGTSTP:
            self.suspend()
        else:
            self.interrupt()

    def end_now(self, reason: str) -> None:
        """Kill the engine if it runs."""
        if self.engine.poll() is None:
            self._kill(reason)

    def leave(self) -> None:
        """Let the engine continue without a supervisor."""
        self._heartbeat.request = Request.CONTINUE_ALONE

    def hang_up(self) -> None:
        """Tell the engine that the terminal is gone; it continues, stops the robot, or ends."""
        self._heartbeat.request = Request.HUNG_UP
        if self._on_hangup == "abort":
            self.stopping = self.stopping or monotonic()
        else:
            self.hung_up = True

    def suspend(self) -> None:
        """Suspend the engine and this process; the body stops by itself. SIGCONT continues both."""
        self.engine.send_signal(signal.SIGSTOP)
        os.kill(os.getpid(), signal.SIGSTOP)
        self._resumed = monotonic()
        self.engine.send_signal(signal.SIGCONT)

    @property
    def phase(self) -> Phase:
        """What the engine is or was doing."""
        return self._heartbeat.phase

    @property
    def node(self) -> str:
        """The node that did not return; empty if none was being ticked."""
        return self._heartbeat.node_name()

    @property
    def progress(self) -> Beat:
        """How far the engine has come."""
        return self._heartbeat.read()

    def close(self) -> None:
        """Release files; the engine is not touched."""
        self.output.finish()
        os.close(self._inbox_end)
        self._file.close()

    def _watch_progress(self) -> None:
        """Report a node that is slow, and an engine that makes no step; in the end, kill it."""
        beat, now = self._heartbeat.read(), monotonic()
        if beat.phase is Phase.CLOSING:
            self._closing = self._closing or now
            if self._is_hung(now - self._closing, now):
                self._kill(f"it did not close its records within {self._hang_timeout:g} s")
        if beat.phase is not Phase.RUNNING:
            return
        here = (beat.step, beat.nodes)
        if here != self._seen[0]:
            self._seen = (here, now)
        ticking = any(node >= 0 for node in beat.nodes)
        since = now - self._seen[1]
        if ticking and since > SLOW_UPDATE:
            self._note_slow(self.node or "a node", since)
        if self._is_suspended():
            self._suspended, self._seen = now, (here, now)
        silent = now - max(beat.wall, self._resumed)
        if silent < SILENT_AFTER:
            self._is_silent = False
            return
        if not self._is_silent:
            self._is_silent = True
            self._tell(f"the engine has made no step for {silent:.0f} s; {self._whereabouts()}")
        if self._is_hung(silent, now):
            self._kill(f"it made no step for {self._hang_timeout:g} s")

    def _is_hung(self, silent: float, now: float) -> bool:
        """Whether a silence, wall seconds, is longer than allowed; not while it is suspended."""
        since = max(now - silent, self._resumed, self._suspended)
        return bool(self._hang_timeout) and now - since > self._hang_timeout

    def _watch_end(self) -> None:
        """Kill an engine that does not end in time after a signal, or after its reports."""
        if self._reported and monotonic() - self._reported > CLOSE_WITHIN:
            self._kill(f"it did not end within {CLOSE_WITHIN:g} s of its report")
            return
        if not self.stopping:
            return
        waited = monotonic() - self.stopping
        writing = self.phase is Phase.CLOSING
        if waited > (CLOSE_WITHIN if writing else STOP_WITHIN):
            self._kill(f"it did not end within {waited:.0f} s of the signal")

    def _note_slow(self, node: str, seconds: float) -> None:
        first = node not in self.slow
        self.slow[node] = max(seconds, self.slow.get(node, 0.0))
        if first:
            self._tell(f"slow: {node} has not returned for {seconds:.1f} s")

    def _whereabouts(self) -> str:
        if self._is_suspended():
            return f"it is suspended; continue it with: kill -CONT {self.engine.pid}"
        node = self.node
        return f"{node} has not returned" if node else "no node is being ticked"

    def _is_suspended(self) -> bool:
        """Whether the engine was stopped by a signal (Linux: state T in proc(5))."""
        try:
            text = Path(f"/proc/{self.engine.pid}/stat").read_text("utf-8", "replace")
        except OSError:
            return False
        return text.rpartition(")")[2].split()[0] in ("T", "t")

    def _kill(self, reason: str) -> None:
        """Kill the engine; after its first step it first writes the stacks of its threads."""
        self.killed = reason
        begins = self.phase in (Phase.STARTING, Phase.COMPILING)
        if not begins and not self._is_suspended():
            with suppress(ProcessLookupError):
                self.engine.send_signal(signal.SIGUSR1)
            sleep(STACKS_WITHIN)
        self.engine.kill()
        self.engine.wait()

    def _tell(self, line: str) -> None:
        """Write a warning after the engine's output, and to log.txt."""
        with suppress(OSError):
            os.write(self._file.fileno(), f"! {line}\n".encode())
        self.log(line)

    def log(self, text: str) -> None:
        """Append to log.txt of the runs."""
        for started in self.started:
            log = Path(started["folder"]) / "log.txt"
            if started["folder"] and log.exists():
                with suppress(OSError), log.open("a", encoding="utf-8") as file:
                    file.write(text + "\n")


class OutputCopier(Thread):
    """Copies what the engine writes to standard error.

    The engine writes to a file, so that it never waits for a terminal; nor does the supervisor,
    because this thread waits in its place.

    Attributes:
        shown: bytes that were copied or passed over.
    """

    def __init__(self, output: IO[bytes], *, show: bool) -> None:
        super().__init__(daemon=True)
        self._output, self.shown, self._show = output.fileno(), 0, show
        self._is_over = Event()

    def show(self) -> None:
        """Copy what is written from now on."""
        if not self._show:
            self.shown, self._show = os.fstat(self._output).st_size, True

    def hide(self) -> None:
        """Copy no more: the terminal shows something else."""
        self._show = False

    def show_all(self) -> None:
        """Copy at once what was not copied so far."""
        self._show = True
        with suppress(OSError):
            self._copy()

    def finish(self) -> None:
        """Copy the rest and end; give up on a terminal that does not take it. Safe to repeat."""
        self._is_over.set()
        self.join(timeout=1.0)

    def run(self) -> None:
        """Copy until the end."""
        with suppress(OSError):  # the terminal is gone
            while not self._is_over.wait(POLL):
                self._copy()
            self._copy()

    def _copy(self) -> None:
        while self._show and (more := os.pread(self._output, 1 << 16, self.shown)):
            self.shown += len(more)
            sys.stderr.write(more.decode(errors="replace"))
            sys.stderr.flush()


def _spawn(message: Mapping[str, Any], output: IO[bytes], shared: Sequence[int]) -> Engine:
    """Start the engine in a session of its own; its standard input is the message."""
    engine = subprocess.Popen(
        command_of("missions.execution.supervision.engine"),
        stdin=subprocess.PIPE, stdout=output, stderr=output, pass_fds=shared,
        start_new_session=True, env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )  # fmt: skip
    assert engine.stdin is not None
    with suppress(BrokenPipeError):
        engine.stdin.write(json.dumps(message, default=str).encode())
        engine.stdin.close()
    return engine
