"""The loop itself, in its own process: deadline, command, kernel, driver, feedback.

It imports NumPy, numba and its driver, and nothing of the brain. Time is the machine's monotonic
clock. The dead man's time runs from when this loop saw a new command, by this clock: a brain that
is frozen, a clock that jumps and a mailbox that nobody writes are all noticed.
"""

from __future__ import annotations

import ctypes
import gc
import json
import os
import signal
import socket
from math import isfinite
from time import monotonic_ns
from typing import Any

import numpy as np

from stack.drivetrain.kernels import CYCLE, cycle
from stack.drivetrain.wheel_loop import (
    COMMAND,
    DEAD_MAN,
    GAINS,
    LEVEL,
    OFF,
    PERIOD,
    RELEASE,
    SILENCE,
    STEERED,
    STOP,
    loop_state,
)
from stack.errors import TreepilotError, exception_sentence
from stack.fast_loop.driver import (
    Driver,
    DriverCommand,
    DriverFeedback,
    DriverSetup,
    driver_class,
)
from stack.fast_loop.kernels import COUNT, count_cycle
from stack.fast_loop.mailbox import PROBLEM, STATISTICS, LoopCommand, LoopFeedback, Mailbox
from stack.fast_loop.privileges import acquire
from stack.parameters import build
from stack.types import FloatArray

LARGEST_SETUP = 1 << 16
"""Bytes of the first message."""

ENDS_WITHIN = 5.0
"""Seconds in which the robot stops before the loop ends; then the wheels are released anyway."""

CATCHES_UP = 0.1
"""Seconds of missed cycles that one cycle makes good: setpoints jump no further."""

REPORTS_EVERY = 0.1
"""Seconds between two records of statistics."""

ENDED, FAILED, REFUSED = 0, 3, 2
"""Exit codes: as asked; an exception of the driver; the driver could not be opened."""


def serve(connection: int, memory: int) -> int:
    """Run the loop until it is told to end, or the brain is gone; return the exit code.

    Args:
        connection: descriptor of the socket to the brain. The first message is the setup.
        memory: descriptor of the mailbox.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the brain handles Ctrl-C and ends the loop
    with socket.socket(fileno=connection) as brain:
        setup = json.loads(brain.recv(LARGEST_SETUP))
        plan = np.array(setup["plan"])
        driver: Driver | None = None
        try:
            for kernel, types in (*CYCLE, *COUNT):
                kernel.compile(types)
            kind = driver_class(setup["driver"])
            made_for = DriverSetup(
                wheels=setup["wheels"], is_steered=bool(plan[STEERED]),
                controls_efforts=bool(plan[GAINS : GAINS + 5].any()), rate=setup["rate"],
            )  # fmt: skip
            driver = kind(made_for, build(kind.Parameters, setup["parameters"]))
            driver.open()
        except Exception as error:
            if driver is not None:
                driver.close()
            _tell(brain, {"error": _words(setup["driver"], error)})
            return REFUSED
        mailbox = Mailbox(memory, setup["wheels"], bytes.fromhex(setup["key"]))
        loop = _Loop(plan, driver, mailbox, brain, setup)
        gc.collect()
        gc.freeze()
        gc.disable()
        granted = acquire() if setup["real_time"] else []
        lacks = [[item.name, item.problem, item.remedy] for item in granted if item.problem]
        _tell(brain, {"lacks": lacks})
        try:
            loop.run()
        except Exception as error:
            loop.feedback.problem = _words(setup["driver"], error)
            loop.report()
            return FAILED
        finally:
            driver.close()
    return ENDED


def _words(driver: str, error: Exception) -> str:
    """Return the device's own words, or what the driver raised that it should not."""
    if isinstance(error, TreepilotError):
        return str(error)
    return f"the driver {driver!r} failed: {exception_sentence(error)}"


def _tell(brain: socket.socket, message: dict[str, Any]) -> None:
    try:
        brain.send(json.dumps(message).encode())
    except OSError:
        pass  # it is gone; the loop notices by its parent


class Sleeper:
    """Sleeps until a time on the monotonic clock; without drift, whatever happens in between."""

    def __init__(self) -> None:
        class Timespec(ctypes.Structure):
            _fields_ = (("seconds", ctypes.c_long), ("nanoseconds", ctypes.c_long))

        self._until = Timespec()
        self._at = ctypes.byref(self._until)
        self._sleep = ctypes.CDLL(None).clock_nanosleep
        self._sleep.restype = ctypes.c_int

    def sleep_until(self, nanoseconds: int) -> None:
        """Sleep until that time; a signal ends the sleep earlier only for its handler."""
        self._until.seconds, self._until.nanoseconds = divmod(nanoseconds, 1_000_000_000)
        monotonic, absolute = 1, 1
        while self._sleep(monotonic, absolute, self._at, None):
            if monotonic_ns() >= nanoseconds:
                return


class _Loop:
    def __init__(
        self, plan: FloatArray, driver: Driver, mailbox: Mailbox, brain: socket.socket,
        setup: dict[str, Any],
    ) -> None:  # fmt: skip
        self._plan, self._driver, self._mailbox, self._brain = plan, driver, mailbox, brain
        self._parent = setup["parent"]
        self._period = round(1e9 / setup["rate"])
        self._state = loop_state(plan, self._period * 1e-9)
        self._setpoints, self.feedback = DriverCommand(self._state), DriverFeedback(self._state)
        self._statistics = np.zeros(STATISTICS, dtype=np.int64)
        self._command = LoopCommand()
        self._seen: int | None = None
        self._seen_number, self._stops, self._released = 0, 0, 0
        self._ends = False
        self._listens = type(driver).receive is not Driver.receive
        signal.signal(signal.SIGTERM, self._end)
        brain.setblocking(False)

    def run(self) -> None:
        """Run cycle after cycle until the loop has been told to end and the wheels are released."""
        sleeper, period = Sleeper(), self._period
        deadline = monotonic_ns()
        reported, problem, work, ends_at = 0, "", 0, None
        while True:
            deadline += period
            sleeper.sleep_until(deadline)
            now = monotonic_ns()
            late = now - deadline
            missed = late // period
            deadline += missed * period
            self._take_command(now, (1 + missed) * period * 1e-9)
            if self._ends and ends_at is None:
                ends_at = now + round(ENDS_WITHIN * 1e9)
            self._advance(now, (1 + missed) * period * 1e-9, ends_at is not None and now > ends_at)
            self._exchange(now)
            count_cycle(self._statistics, late, work, missed)
            has_ended = self._ends and self._state[LEVEL] == OFF
            changed = self.feedback.problem != problem
            if changed or has_ended or now - reported > REPORTS_EVERY * 1e9:
                reported, problem = now, self.feedback.problem
                self.report()
            if has_ended:
                return
            work = monotonic_ns() - now

    def report(self) -> None:
        """Write the statistics and the problem into the mailbox."""
        problem = self.feedback.problem.encode()[:PROBLEM].ljust(PROBLEM, b"\0")
        self._mailbox.statistics.write(self._statistics.tobytes() + problem)

    def _take_command(self, now: int, elapsed: float) -> None:
        """Read the mailbox. After a gap a command may be as old as the gap: the next one counts."""
        content = self._mailbox.command.read()
        if content is None:
            return
        command = LoopCommand.unpacked(content)
        self._stops = max(self._stops, command.stops)
        self._released = max(self._released, command.released)
        self._ends = self._ends or bool(command.end)
        if not all(map(isfinite, command.twist)):
            return
        self._command, self._seen_number = command, self._mailbox.command.number
        if elapsed < self._plan[DEAD_MAN]:
            self._seen = now

    def _advance(self, now: int, elapsed: float, at_once: bool) -> None:
        """Compute the setpoints of this cycle."""
        state, command = self._state, self._command
        self._ends = self._ends or os.getppid() != self._parent
        state[PERIOD] = min(elapsed, CATCHES_UP)
        state[SILENCE] = np.inf if self._seen is None else (now - self._seen) * 1e-9
        stop = self._ends or self._stops > self._released or self.feedback.problem
        state[STOP], state[RELEASE] = bool(stop), bool(command.off) or at_once
        state[COMMAND : COMMAND + 3] = command.twist if self.feedback.is_ready else 0.0
        cycle(self._plan, state)

    def _exchange(self, now: int) -> None:
        """Hand the setpoints to the driver, and its measurements and messages to the brain."""
        setpoints, state = self._setpoints, self._state
        setpoints.now, setpoints.period = now * 1e-9, float(state[PERIOD])
        if self._listens:
            try:
                message = self._brain.recv(LARGEST_SETUP)
            except OSError:
                message = b""
            if message:
                self._driver.receive(message)
        self._driver.exchange(setpoints, self.feedback)
        cycles, refused = int(self._statistics[0]), self._mailbox.command.refused
        standing = max(0, self._stops - self._released)
        self._mailbox.feedback.write(
            LoopFeedback(
                cycles, self._seen_number, setpoints.now, refused, standing, state.tobytes()
            ).packed()
        )
        for encoded in self._driver.messages():
            try:
                self._brain.send(encoded)
            except OSError:
                break  # the brain does not read, or is gone

    def _end(self, *_: object) -> None:
        self._ends = True
