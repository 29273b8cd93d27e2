"""The brain's side of a fast loop: starts the process, commands it, reads it, notices its end."""

from __future__ import annotations

import json
import os
import secrets
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from time import monotonic  # noqa: TID251 - how long another process is waited for
from typing import Any

import numpy as np

from stack.drivetrain.kernels import CYCLE
from stack.drivetrain.wheel_loop import WHEELS
from stack.errors import BodyError
from stack.fast_loop.driver import driver_class
from stack.fast_loop.kernels import (
    BIN_COUNT,
    BINS,
    COUNT,
    CYCLES,
    OVERRUNS,
    TOTAL_WORK,
    WORST_LATE,
    WORST_WORK,
)
from stack.fast_loop.mailbox import STATISTICS, LoopCommand, LoopFeedback, Mailbox
from stack.fast_loop.privileges import Privilege
from stack.parameters import build
from stack.types import STANDSTILL, FloatArray, LoopStatistics, Twist

SILENT = 0.3
"""Seconds without feedback after which the loop counts as frozen."""

ENDS_WITHIN = 6.0
"""Seconds that the process may take to stop the robot and end."""

LARGEST_MESSAGE = 1 << 16
"""Bytes of a message of the driver."""


@dataclass(frozen=True)
class LoopSetup:
    """What a fast loop runs.

    Attributes:
        plan: of the wheel loop (stack/drivetrain/wheel_loop.py).
        driver: name of the driver.
        parameters: of the driver, as in a file.
        rate: cycles per second.
        opens_within: seconds that the process and its driver may take to begin.
        real_time: whether it asks for real-time privileges.
    """

    plan: FloatArray
    driver: str = "emulated"
    parameters: Mapping[str, Any] = field(default_factory=dict)
    rate: float = 500.0
    opens_within: float = 30.0
    real_time: bool = True


class FastLoop:
    """A running fast loop. Ended with `close`, or when this process is gone.

    Args:
        setup: of the loop.

    Attributes:
        setup: as given.
        lacks: privileges that the process did not get.
        mailbox: shared with the process.

    Raises:
        InputError: there is no such driver.
        ParameterError: a parameter of the driver is wrong.
        BodyError: the hardware does not respond, or the process does not begin in time.
    """

    def __init__(self, setup: LoopSetup) -> None:
        self.setup = setup
        build(driver_class(setup.driver).Parameters, dict(setup.parameters))
        for kernel, types in (*CYCLE, *COUNT):
            kernel.compile(types)  # for numba's cache: the process then has no time to wait for
        wheels, key = int(setup.plan[WHEELS]), secrets.token_bytes(32)
        self.mailbox = Mailbox(Mailbox.new_file(wheels), wheels, key)
        self._command = LoopCommand()
        self._fed_at, self._feedback, self._fault = monotonic(), None, ""
        self._statistics: bytes | None = None
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket = ours
        with theirs:
            self._process = _start(theirs.fileno(), self.mailbox.descriptor)
        try:
            self.lacks = self._begin(key, wheels)
        except BaseException:
            self._process.kill()
            self._process.wait()
            self._shut()
            raise

    _feedback: LoopFeedback | None

    @property
    def pid(self) -> int:
        """Number of the process."""
        return self._process.pid

    @property
    def has_ended(self) -> bool:
        """Whether the process is gone."""
        return self._process.poll() is not None

    def command(self, twist: Twist) -> None:
        """Command a velocity; each call counts as a sign of life, also with the same velocity."""
        components = (twist.linear, twist.angular, twist.lateral)
        self._write(replace(self._command, twist=components))

    def emergency_stop(self) -> None:
        """Stop within the limits and release the wheels, until `release`."""
        self._write(replace(self._command, twist=_NONE, stops=self._command.stops + 1))

    def release(self) -> None:
        """End the emergency stop. The robot stands until it is commanded."""
        self._write(replace(self._command, twist=_NONE, released=self._command.stops))

    def feedback(self) -> LoopFeedback | None:
        """Return the newest feedback; None before the first cycle."""
        content = self.mailbox.feedback.read()
        if content is not None:
            self._feedback, self._fed_at = LoopFeedback.unpacked(content), monotonic()
        return self._feedback

    def statistics(self) -> LoopStatistics:
        """Return the timing so far; it is up to 0.1 s old."""
        self._read_statistics()
        lacks = tuple(f"{item.name}: {item.problem}" for item in self.lacks)
        if self._statistics is None:
            return LoopStatistics(self.setup.rate, lacks=lacks)
        numbers = np.frombuffer(self._statistics, dtype=np.int64, count=STATISTICS).tolist()
        cycles = numbers[CYCLES]
        return LoopStatistics(
            self.setup.rate, cycles, numbers[OVERRUNS], numbers[WORST_LATE] * 1e-9,
            numbers[TOTAL_WORK] * 1e-9 / max(1, cycles), numbers[WORST_WORK] * 1e-9,
            tuple(numbers[BINS : BINS + BIN_COUNT]), lacks,
        )  # fmt: skip

    @property
    def problem(self) -> str:
        """Why the process does not work: it has ended or is frozen; empty if it does."""
        code = self._process.poll()
        if code is not None:
            how = f"was killed ({_signal_name(-code)})" if code < 0 else f"ended with code {code}"
            return f"the fast loop {how}{f': {self.fault}' if self.fault else ''}"
        self.feedback()
        if monotonic() - self._fed_at > SILENT:
            return f"the fast loop has not answered for more than {SILENT:g} s"
        return ""

    @property
    def fault(self) -> str:
        """What the driver reports, in the device's own words; empty if the robot can drive."""
        self._read_statistics()
        return self._fault

    def send(self, message: bytes) -> bool:
        """Send a message to the driver; return whether it was taken (its buffer may be full)."""
        try:
            return self._socket.send(message, socket.MSG_DONTWAIT) == len(message)
        except OSError:
            return False

    def messages(self) -> list[bytes]:
        """Return the messages of the driver since the last call, in order."""
        found: list[bytes] = []
        with suppress(OSError):
            while message := self._socket.recv(LARGEST_MESSAGE, socket.MSG_DONTWAIT):
                found.append(message)
        return found

    def close(self) -> None:
        """Stop the robot, release the wheels and end the process. Safe to call twice."""
        if self._socket.fileno() < 0:
            return
        self._write(replace(self._command, twist=_NONE, end=1))
        try:
            self._process.wait(ENDS_WITHIN)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self.feedback()
        self._shut()

    def _shut(self) -> None:
        self._socket.close()
        self.mailbox.close()

    def _write(self, command: LoopCommand) -> None:
        self._command = command
        self.mailbox.command.write(command.packed())

    def _read_statistics(self) -> None:
        content = self.mailbox.statistics.read()
        if content is not None:
            self._statistics = content
            self._fault = content[8 * STATISTICS :].rstrip(b"\0").decode(errors="replace")

    def _begin(self, key: bytes, wheels: int) -> list[Privilege]:
        """Hand over the setup and wait until the loop runs."""
        setup = {
            "plan": self.setup.plan.tolist(), "wheels": wheels, "key": key.hex(),
            "driver": self.setup.driver, "parameters": dict(self.setup.parameters),
            "rate": self.setup.rate, "parent": os.getpid(), "real_time": self.setup.real_time,
        }  # fmt: skip
        self._socket.send(json.dumps(setup).encode())
        self._socket.settimeout(self.setup.opens_within)
        try:
            answer = self._socket.recv(LARGEST_MESSAGE)
        except TimeoutError:
            limit = self.setup.opens_within
            raise BodyError(
                f"the driver {self.setup.driver!r} did not open within {limit:g} s"
            ) from None
        if not answer:
            code = self._process.wait(ENDS_WITHIN)
            raise BodyError(f"the fast loop ended with code {code} before it began")
        found = json.loads(answer)
        if "error" in found:
            raise BodyError(found["error"])
        self._socket.setblocking(False)
        self._fed_at = monotonic()
        return [Privilege(*item) for item in found["lacks"]]


_NONE = (STANDSTILL.linear, STANDSTILL.angular, STANDSTILL.lateral)


def _start(connection: int, memory: int) -> subprocess.Popen[bytes]:
    """Start the process: its own interpreter, its own process group, so that Ctrl-C is ours."""
    path = os.pathsep.join(place or os.getcwd() for place in sys.path)
    return subprocess.Popen(
        [sys.executable, "-m", "stack.fast_loop", str(connection), str(memory)],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        pass_fds=[connection, memory],
        process_group=0,
        env={**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"},
    )


def _signal_name(number: int) -> str:
    with suppress(ValueError):
        return signal.Signals(number).name
    return f"signal {number}"
