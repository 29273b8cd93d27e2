"""Reactions to faults: seconds and metres from the cause until the robot stands, from 0.5 m/s.

    python -m tests.benchmarks.reactions [COUNT] [--only WORD]

`clock`: the mission runs in this process on a simulated robot; the times are its clock's, and
exact. `rover`: `treepilot run` drives an emulated ArduRover over MAVLink, on the wall clock. A
pilot who takes over drives himself: his row is the time until the mission is paused. `CAN`:
`treepilot run` drives emulated motor drives of a robot in another process, on the wall clock.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time  # real processes
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import hypot
from pathlib import Path
from statistics import median
from typing import Any, TypeVar

from robots.motors.can_simple import AxisError
from robots.simulated import SimulatedBody
from stack.body import CLOCK, LINK, MOTOR, PILOT, BodyHealth
from tests.benchmarks.over_the_wire import ROBOTS, ROOT
from tests.missions.execution.live_run import LiveRun
from tests.missions.execution.lossy_relay import free_port
from tests.robots.mavlink.emulated_rover import EmulatedRover, Settings
from tests.robots.motors.emulated_robot import START, RobotProcess, robot_process

T = TypeVar("T")

DRIVE = "run: {drive_on_heading: {distance: 3 m, speed: 0.5}}\n"
MISSION = f"""
mission: straight on
format: 1
robot: ./robot.yaml
world: office
start: dock
localisation: dead_reckoning
navigation: {{failsafe: {{low_battery: pause}}}}
{DRIVE}"""
WAITS = 60.0
"""Wall seconds that a mission gets until its robot drives."""

BEGIN = 2.0
"""Seconds of simulated time at which something goes wrong."""

AHEAD = 0.6
"""Metres from the start to the fence: the robot has its speed there."""


# On the wall clock, over CAN.


def _children(pid: int) -> list[int]:
    return [int(n) for n in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def _engine(supervisor: int) -> int:
    """The process of the mission: the one that has a fast loop."""
    return next(pid for pid in _children(supervisor) if _loop(pid))


def _loop(engine: int) -> int:
    """Its fast loop; 0 without one."""
    for pid in _children(engine):
        if b"stack.fast_loop" in Path(f"/proc/{pid}/cmdline").read_bytes():
            return pid
    return 0


def _ordered(**values: Any) -> Callable[[RobotProcess, int], None]:
    return lambda robot, engine: robot.order(**values)


def _signalled(
    number: signal.Signals, *, loop: bool = False
) -> Callable[[RobotProcess, int], None]:
    def cause(robot: RobotProcess, engine: int) -> None:
        robot.order()
        os.kill(_loop(engine) if loop else engine, number)

    return cause


PROCESSES: dict[str, Callable[[RobotProcess, int], None]] = {
    "motor error on one axis": _ordered(node=1, error=int(AxisError.DRV_FAULT)),
    "low battery": _ordered(voltage=20.5),
    "scan stale": _ordered(lidar=False),
    "brain killed": _signalled(signal.SIGKILL),
    "brain frozen": _signalled(signal.SIGSTOP),
    "fast loop killed": _signalled(signal.SIGKILL, loop=True),
    "fast loop frozen": _signalled(signal.SIGSTOP, loop=True),
}


def in_processes(cause: Callable[[RobotProcess, int], None]) -> tuple[float, float]:
    """Seconds and metres until the wheels stand."""
    with tempfile.TemporaryDirectory() as name, robot_process("46_own_wheels") as robot:
        folder = Path(name)
        text = (ROBOTS / "scout_wheels" / "robot.yaml").read_text()
        text = text.replace("../scout", str(ROBOTS / "scout"))
        text = text.replace("port: 5610", f"port: {robot.port}")
        (folder / "robot.yaml").write_text(f"{text}body: {robot.body}\n")
        limit = threading.Timer(WAITS, robot.process.kill)  # its lines end then
        limit.start()
        with _command(folder) as command:
            robot.await_line("rolls")
            engine = _engine(command.pid)
            ours = [_loop(engine), engine]
            try:
                cause(robot, engine)
                seconds, metres = robot.await_line().split()
            finally:
                limit.cancel()
                for pid in ours:
                    with suppress(ProcessLookupError):
                        os.kill(pid, signal.SIGKILL)
        return float(seconds), float(metres)


# On the wall clock, over MAVLink.


def on_the_rover(cause: Callable[[EmulatedRover], None], *, stands: bool) -> tuple[float, float]:
    """Seconds and metres until the rover stands, or until the failsafe is in the log."""
    port, rover = free_port(), EmulatedRover(Settings(refuses_arming=0))
    thread = threading.Thread(target=rover.run, args=(port,), daemon=True)
    with tempfile.TemporaryDirectory() as name:
        folder, log = Path(name), Path(name) / "run" / "events.jsonl"
        text = (ROOT / "tests/robots/mavlink/rover.yaml").read_text()
        text = text.replace("../../../robots", str(ROBOTS))
        body = f"body: {{use: mavlink, connect: 'udpin:127.0.0.1:{port}'}}\n"
        (folder / "robot.yaml").write_text(text + body)
        thread.start()
        with _command(folder) as command:
            _await(lambda: rover.driven > START, command)
            began, way = time.monotonic(), rover.driven  # noqa: TID251
            cause(rover)
            if stands:
                _await(lambda: abs(rover.speed) < 0.01, command)
            else:
                _await(lambda: '"kind":"failsafe"' in log.read_text(), command)
            found = time.monotonic() - began, rover.driven - way  # noqa: TID251
        rover.ended.set()
        thread.join()
    return found


ROVER: dict[str, tuple[Callable[[EmulatedRover], None], bool]] = {
    "link lost, both ways": (lambda rover: setattr(rover, "silent", True), True),
    "pilot changes the mode": (lambda rover: rover.set_mode("MANUAL"), False),
}


def _await(condition: Callable[[], bool], command: subprocess.Popen[bytes]) -> None:
    limit = time.monotonic() + WAITS  # noqa: TID251
    while not condition():
        assert time.monotonic() < limit and command.poll() is None, "the mission has ended"  # noqa: TID251
        time.sleep(0.005)  # noqa: TID251


@contextmanager
def _command(folder: Path) -> Iterator[subprocess.Popen[bytes]]:
    """`treepilot run` of the mission with the robot file in a folder; it ends with the block."""
    (folder / "straight.yaml").write_text(MISSION)
    words = ["run", str(folder / "straight.yaml"), "--headless", "--out", str(folder / "run")]
    command = subprocess.Popen(
        [sys.executable, "-m", "treepilot", *words], cwd=ROOT,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        yield command
    finally:
        command.terminate()
        command.wait()


# On the simulated clock.


class Failing(SimulatedBody):
    """A simulated robot that reports a problem from BEGIN on."""

    def __init__(self, setup: Any, problem: str) -> None:
        super().__init__(
            setup.robot, setup.world, start=setup.start, seed=setup.seed, faults=setup.faults
        )
        self._problem = problem

    @property
    def health(self) -> BodyHealth:
        """The problem, if there is one."""
        reports = self._problem and self.time >= BEGIN
        return BodyHealth("it says why", self._problem) if reports else BodyHealth()


SIMULATED = {
    "link, motor error, pilot or clock, once the body reports it": (LINK, ""),
    "low battery": ("battery_sag: {drop: 0.85}", "low_battery: pause"),
    "scan stale": ("sensor_loss: {sensor: lidar}", ""),
    "outside the fence": ("fence", "fence: {fence}"),
}


def on_the_clock(fault: str, settings: str) -> tuple[float, float]:
    """Simulated seconds and metres until the robot stands."""
    with tempfile.TemporaryDirectory() as name:
        x, y = 1.0, 1.0
        corners = [[x - 1, y - 1], [x + AHEAD, y - 1], [x + AHEAD, y + 1], [x - 1, y + 1]]
        written = settings.replace("{fence}", json.dumps(corners))
        head = (
            "mission: straight on\nformat: 1\nrobot: scout\nworld: small_room\n"
            f"start: [{x}, {y}, 0]\n"
            f"localisation: dead_reckoning\nnavigation: {{failsafe: {{{written}}}}}\n"
        )
        if ":" in fault:
            head += f"faults: [{{{fault}, at: {BEGIN} s}}]\n"
        problem = fault if fault in (LINK, MOTOR, PILOT, CLOCK) else ""
        run = LiveRun(Path(name) / "m", DRIVE, head, make_body=lambda s: Failing(s, problem))
        body, cause = run.engine.body, None
        try:
            while True:
                run.steps()
                pose, twist = body.truth.pose, body.truth.twist
                is_wrong = pose.x > x + AHEAD if fault == "fence" else body.time >= BEGIN
                if cause is None and is_wrong:
                    cause = body.time, pose
                if cause is not None and hypot(twist.linear, twist.lateral) < 0.01:
                    return body.time - cause[0], pose.distance_to(cause[1])
        finally:
            run.close()


def main() -> None:
    """Print a row for each fault."""
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("count", type=int, nargs="?", default=3, help="of each fault [3]")
    options.add_argument("--only", default="", metavar="WORD", help="faults with this in the name")
    given = options.parse_args()
    count, only = given.count, given.only
    print("| fault | where | stands after | worst | distance | worst |\n|---|---|---|---|---|---|")
    for name, (fault, settings) in _chosen(SIMULATED, only):
        _row(name, "clock", [on_the_clock(fault, settings)])
    for name, (happens, stands) in _chosen(ROVER, only):
        _row(name, "rover", [on_the_rover(happens, stands=stands) for _ in range(count)])
    for name, cause in _chosen(PROCESSES, only):
        _row(name, "CAN", [in_processes(cause) for _ in range(count)])
        time.sleep(0.5)  # noqa: TID251 - the ports of the last run


def _chosen(faults: dict[str, T], only: str) -> list[tuple[str, T]]:
    return [(name, fault) for name, fault in faults.items() if only in name]


def _row(name: str, where: str, found: list[tuple[float, float]]) -> None:
    times, ways = zip(*found, strict=True)
    print(
        f"| {name} | {where} | {median(times):.2f} s | {max(times):.2f} s |"
        f" {median(ways):.2f} m | {max(ways):.2f} m |",
        flush=True,
    )


if __name__ == "__main__":
    main()
