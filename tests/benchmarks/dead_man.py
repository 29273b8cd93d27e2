"""Dead man: wall time from the end of a brain until the wheels stand.

    python -m tests.benchmarks.dead_man [COUNT]

A brain in a process of its own commands a fast loop with emulated wheels. It is killed (SIGKILL) or
frozen (SIGSTOP). All processes read the same clock (CLOCK_MONOTONIC): the brain writes down when it
commands, the driver when its wheels begin to stop and when they stand.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import STOP_DECELERATION, Limits
from stack.drivetrain.wheel_loop import loop_plan
from stack.fast_loop.driver import GROUP, DriverCommand, DriverFeedback
from stack.fast_loop.emulated import Emulated
from stack.types import Twist

SPEED, PERIOD, COMMANDS = 0.5, 0.05, 12
"""Of the robot, m/s; of the brain's commands, s, and how many make sure that it drives."""
SCOUT, STIFF = STOP_DECELERATION, 40.0
"""`stop_deceleration`, m/s²: of the robot scout, and one that stops the wheels in 0.0125 s."""
LAG = "1 ms"
WAITS = 120.0
"""Wall seconds: longest wait for another process."""


class StampedWheels(Emulated):
    """Emulated wheels that write down, in the folder DEAD_MAN, when they stop."""

    def __init__(self, setup: Any, parameters: Any) -> None:
        super().__init__(setup, parameters)
        self._file = os.open(Path(os.environ["DEAD_MAN"]) / "wheels", os.O_WRONLY | os.O_CREAT)
        self._level, self._stood, self._last, self._gap = 0, True, 0.0, 0.0

    def exchange(self, command: DriverCommand, feedback: DriverFeedback) -> None:
        """Advance the wheels; write each change of level, and each stop with the longest gap."""
        super().exchange(command, feedback)
        if self._last and command.level != 2:
            self._gap = max(self._gap, command.now - self._last)
        self._last = command.now
        if command.level != self._level:
            self._level = command.level
            self._write(f"level{command.level}", command.now)
        stands = not feedback.speeds.any()
        if stands != self._stood:
            self._stood = stands
            self._write("stands" if stands else "rolls", command.now)

    def _write(self, what: str, now: float) -> None:
        os.write(self._file, f"{what} {now:.6f} {self._gap:.6f}\n".encode())


@dataclass(frozen=True)
class Stop:
    """What followed the end of a brain, seconds.

    Attributes:
        noticed: from its last sign of life (a command, or the signal that killed it) until the
            loop began to stop.
        stood: until the wheels stood.
        gap: longest time between two cycles: what the machine, not the loop, may add.
    """

    noticed: float
    stood: float
    gap: float


def stops_after(number: signal.Signals, deceleration: float, count: int = 1) -> list[Stop]:
    """Send a signal to a brain that drives, several times; return what its wheels did.

    A killed brain is replaced, a frozen one continued.
    """
    if number == signal.SIGKILL and count > 1:
        return [stop for _ in range(count) for stop in stops_after(number, deceleration)]
    found: list[Stop] = []
    with tempfile.TemporaryDirectory() as name, _brain(Path(name), deceleration) as process:
        commands, wheels, known = Path(name) / "brain", Path(name) / "wheels", 0
        for _ in range(count):
            wanted = len(_lines(commands)) + COMMANDS
            _await(lambda n=wanted: process.poll() is not None or len(_lines(commands)) > n)
            assert process.poll() is None, "the brain ended by itself"
            process.send_signal(number)
            sent = time.monotonic()  # noqa: TID251
            _await(lambda n=known: any(line[0] == "stands" for line in _lines(wheels)[n:]))
            last_command = float(_lines(commands)[-1][1])
            alive = last_command if number == signal.SIGSTOP else sent
            new = _lines(wheels)[known:]
            began = next(float(line[1]) for line in new if line[0] == "level1")
            stood, gap = next((float(a), float(b)) for word, a, b in new if word == "stands")
            found.append(Stop(began - alive, stood - alive, gap))
            if number == signal.SIGSTOP:
                known = len(_lines(wheels))
                process.send_signal(signal.SIGCONT)
    return found


@contextmanager
def _brain(folder: Path, deceleration: float) -> Iterator[subprocess.Popen[bytes]]:
    """A brain that drives, with the driver `stamped` installed; killed at the end."""
    metadata = folder / "stamped-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: stamped\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text(
        f"[{GROUP}]\nstamped = tests.benchmarks.dead_man:StampedWheels\n"
    )
    path = os.pathsep.join([str(folder), *(place or os.getcwd() for place in sys.path)])
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.benchmarks.dead_man", "brain", str(deceleration)],
        env={**os.environ, "PYTHONPATH": path, "DEAD_MAN": str(folder)},
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def _lines(file: Path) -> list[list[str]]:
    """The complete lines of a file, as words."""
    text = file.read_text() if file.exists() else ""
    return [line.split() for line in text[: text.rfind("\n") + 1].splitlines()]


def _await(condition: Any) -> None:
    limit = time.monotonic() + WAITS  # noqa: TID251
    while not condition():
        assert time.monotonic() < limit, "the other process does not get on"  # noqa: TID251
        time.sleep(0.01)  # noqa: TID251


def brain(deceleration: float) -> None:
    """Drive until this process is killed."""
    from stack.fast_loop.client import FastLoop, LoopSetup

    limits = Limits(linear_speed=SPEED, linear_acceleration=4.0, stop_deceleration=deceleration)
    plan = loop_plan(Wheels(("l",), ("r",), 0.1, 0.4).drivetrain(limits), 0.3, 2.0)
    loop = FastLoop(LoopSetup(plan, "stamped", {"lag": LAG}, 1000.0))
    stamps = os.open(Path(os.environ["DEAD_MAN"]) / "brain", os.O_WRONLY | os.O_CREAT)
    while True:
        loop.command(Twist(SPEED))
        os.write(stamps, f"command {time.monotonic():.6f}\n".encode())  # noqa: TID251
        time.sleep(PERIOD)  # noqa: TID251


def measure(count: int) -> None:
    """Print a row for each kind of end and each deceleration, milliseconds."""
    print(f"{'':26}{'count':>6}{'noticed':>9}{'worst':>8}{'stood':>8}{'worst':>8}{'gap':>7}  ms")
    for number in (signal.SIGKILL, signal.SIGSTOP):
        for deceleration in (STIFF, SCOUT):
            stops = stops_after(number, deceleration, count)
            noticed, stood = [s.noticed for s in stops], [s.stood for s in stops]
            gap = max(s.gap for s in stops)
            figures = (median(noticed), max(noticed), median(stood), max(stood), gap)
            words = f"{number.name}, {deceleration:g} m/s²"
            print(f"{words:26}{count:6}{''.join(f'{1000 * x:8.1f}' for x in figures)}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["brain"]:
        brain(float(sys.argv[2]))
    else:
        measure(int(sys.argv[1]) if len(sys.argv) > 1 else 50)
