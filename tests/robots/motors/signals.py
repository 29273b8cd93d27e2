"""Wheels on emulated axes when the brain or the fast loop is killed or frozen: real processes.

    python -m tests.robots.motors.signals [COUNT]

prints the wall times from the signal until the wheels stand, and how far they rolled. All processes
read CLOCK_MONOTONIC.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from math import tau
from statistics import median

from stack.drivetrain.differential import Wheels
from stack.drivetrain.limits import Limits
from stack.drivetrain.wheel_loop import loop_plan
from stack.fast_loop.client import FastLoop, LoopSetup
from stack.types import Twist
from tests.robots.motors.axes_process import axes_process
from tests.robots.motors.virtual import RADIUS, SCOUT, SPEED, STIFF

COMMANDS = 40
"""Of the brain, 50 a second, until the robot has its speed and the signal comes."""


@dataclass(frozen=True)
class Stop:
    """Seconds until both wheels stood, metres that the one which went farther rolled until then."""

    stood: float
    distance: float


def stop_after(victim: str, number: signal.Signals, deceleration: float) -> Stop:
    """Send a signal to the `brain` or its `loop` while the robot drives."""
    with axes_process() as axes:
        axes.order(gain=50.0)
        arguments = [axes.channel, str(deceleration)]
        brain = subprocess.Popen(
            [sys.executable, "-m", "tests.robots.motors.signals", "brain", *arguments],
            stdout=subprocess.PIPE, text=True,
        )  # fmt: skip
        loop = None
        try:
            loop = int(brain.stdout.readline())
            assert brain.stdout.readline() == "drives\n", "the brain has ended"
            _, before = axes.order()
            pid = brain.pid if victim == "brain" else loop
            os.kill(pid, number)
            sent = time.monotonic()  # noqa: TID251
            _, at, *places = axes.await_line("stands")
            start = [place for place, _ in before]
            rolled = max(abs(float(b) - a) for a, b in zip(start, places, strict=True))
            _, after = axes.order()
            assert all(speed == 0.0 for _, speed in after)
            return Stop(float(at) - sent, tau * RADIUS * rolled)
        finally:
            brain.kill()
            brain.wait()
            brain.stdout.close()
            if loop is not None:
                try:
                    os.kill(loop, signal.SIGKILL)
                except ProcessLookupError:
                    pass


def brain(channel: str, deceleration: float) -> None:
    """Drive until this process is killed."""
    limits = Limits(linear_speed=SPEED, linear_acceleration=4.0, stop_deceleration=deceleration)
    plan = loop_plan(Wheels(("l",), ("r",), RADIUS, 0.4).drivetrain(limits), 0.3, 2.0)
    values = {"interface": "udp_multicast", "channel": channel, "silent_after": 1.0}
    loop = FastLoop(LoopSetup(plan, "odrive_can", values, 250.0))
    print(loop.pid, flush=True)
    commands = 0
    while True:
        loop.command(Twist(SPEED))
        feedback = loop.feedback()
        commands = commands + 1 if feedback is not None and not loop.fault else 0
        if commands == COMMANDS:
            print("drives", flush=True)
        time.sleep(0.02)  # noqa: TID251


CASES = [
    ("brain", signal.SIGKILL, STIFF), ("brain", signal.SIGSTOP, STIFF),
    ("brain", signal.SIGKILL, SCOUT), ("brain", signal.SIGSTOP, SCOUT),
    ("loop", signal.SIGKILL, SCOUT), ("loop", signal.SIGSTOP, SCOUT),
]  # fmt: skip


def measure(count: int) -> None:
    """Print a row for each case: seconds until the wheels stand, metres; median and worst."""
    for victim, number, deceleration in CASES:
        stops = [stop_after(victim, number, deceleration) for _ in range(count)]
        times, distances = [s.stood for s in stops], [s.distance for s in stops]
        print(
            f"{victim:6} {number.name:8} {deceleration:4g} m/s²  {count:3}"
            f"  {median(times):.3f} s  {max(times):.3f} s"
            f"  {median(distances):.3f} m  {max(distances):.3f} m",
            flush=True,
        )


if __name__ == "__main__":
    if sys.argv[1:2] == ["brain"]:
        brain(sys.argv[2], float(sys.argv[3]))
    else:
        measure(int(sys.argv[1]) if len(sys.argv) > 1 else 10)
