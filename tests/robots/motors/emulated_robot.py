"""A robot of which only motor drives and lidar are seen: emulated axes in a simulated world.

    python -m tests.robots.motors.emulated_robot CHANNEL PORT MISSION

The axes are on the bus `udp_multicast` at CHANNEL. The robot of the mission's world moves as they
turn, and its lidar sends JSON datagrams to PORT on 127.0.0.1. `ready` is printed when both begin.
Each line of standard input is an order, a JSON object: attributes of all axes, or of one with
`node`; `error` for them; `lidar`, whether scans are sent. After each order the seconds until both
wheels stand are printed, and the metres that the one which goes farther rolls. `rolls` is printed
once the robot has gone START metres. When standard input is closed, it prints what happened as
JSON, and ends. All of it is in real time.
"""

from __future__ import annotations

import json
import os
import select
import socket
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass, replace
from math import tau

import numpy as np

from missions.execution.prepare import RunOptions, prepare
from robots.motors.can_bus import BusAddress
from robots.simulated import SimulatedBody
from stack.body import BodyCommand
from stack.drivetrain.limits import Limits
from stack.types import Scan, Twist
from tests.robots.motors import emulated_axes
from tests.robots.motors.axes_process import free_channel

STEP, WORLD_STEP = 0.001, 0.01
"""Seconds: of the axes; of the world, a multiple of its physics period."""

BEHIND = 0.2
"""Seconds that a busy machine may lag; more is left out, for the axes and the world alike."""

START = 0.7
"""Metres after which the robot has its speed."""

FREE = Limits(
    linear_speed=5.0, reverse_speed=5.0, angular_speed=20.0, linear_acceleration=100.0,
    linear_deceleration=100.0, angular_acceleration=400.0,
)  # fmt: skip
"""The simulated wheels obey the axes, which have limits of their own."""


class EmulatedRobot:
    """Axes and world, with one clock.

    Args:
        mission: whose robot, world and start it has.
        send: sends a scan as bytes.
    """

    def __init__(self, mission, send):
        plan = prepare(mission, RunOptions())
        robot = replace(plan.robot, limits=FREE, actual=None)
        self._drive, self._send = plan.robot.drivetrain, send
        self.body = SimulatedBody(robot, plan.world, start=plan.start, seed=1)
        self.axes = [emulated_axes.EmulatedAxis(node) for node in (0, 1)]
        self.lidar, self._rolls, self._ordered = True, False, None

    def step_world(self):
        """Advance the world by WORLD_STEP with the speeds of the axes; send a new scan."""
        rims = [
            radius * tau * axis.velocity
            for radius, axis in zip(self._drive.radii, self.axes, strict=True)
        ]
        moves = self._drive.from_wheels(rims, [0.0, 0.0], ())
        self.body.command(BodyCommand(Twist(moves.x, moves.heading)))
        self.body.wait(WORLD_STEP)
        for scan in self.body.sense().of(Scan).values():
            if self.lidar:
                self._send(datagram(scan))

    def obey(self, order, now):
        """Change the axes or the lidar; measure from now on until the wheels stand."""
        node, error = order.pop("node", None), order.pop("error", 0)
        self.lidar = order.pop("lidar", self.lidar)
        for axis in self.axes:
            if node in (None, axis.node):
                for name, value in order.items():
                    assert hasattr(axis, name), name
                    setattr(axis, name, value)
                if error:
                    axis.fail(error)
        self._ordered = now, [axis.position for axis in self.axes]

    def news(self, now):
        """Yield `rolls` once, and how it stood after an order."""
        if self._ordered is None and not self._rolls and self._rolled([0.0, 0.0]) > START:
            self._rolls = True
            yield "rolls"
        if self._ordered is not None and not any(axis.velocity for axis in self.axes):
            since, places = self._ordered
            self._ordered = None
            yield f"{now - since:.4f} {self._rolled(places):.4f}"

    def _rolled(self, places):
        turned = [abs(axis.position - at) for axis, at in zip(self.axes, places, strict=True)]
        return max(tau * r * t for r, t in zip(self._drive.radii, turned, strict=True))

    def report(self):
        """Return what happened, as JSON."""
        pose, tally = self.body.truth.pose, self.body.tally
        return {
            "x": pose.x, "y": pose.y, "heading": pose.heading, "collisions": tally.by_robot,
            "min_clearance_m": self.body.clearance,
        }  # fmt: skip


def datagram(scan):
    """A scan in the form of the driver `udp_scan`."""
    ranges = np.where(np.isinf(scan.ranges), 2.0 * scan.range_max, scan.ranges).tolist()
    return json.dumps(
        {
            "stamp": scan.stamp, "angle_min": scan.angle_min,
            "angle_increment": scan.angle_increment, "range_min": scan.range_min,
            "range_max": scan.range_max, "time_increment": scan.time_increment,
            "ranges": [None if np.isnan(value) else round(value, 4) for value in ranges],
        }
    ).encode()  # fmt: skip


def read_orders():
    """Return the orders that have come; None when standard input is closed."""
    if not select.select([0], [], [], 0.0)[0]:
        return []
    lines = os.read(0, 4096).splitlines()
    return [json.loads(line) for line in lines] or None


def main(channel, port, mission):
    import can

    bus = can.Bus(**BusAddress("udp_multicast", channel).arguments())
    lidar = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    robot = EmulatedRobot(mission, lambda scan: lidar.sendto(scan, ("127.0.0.1", port)))
    robot.step_world()  # loads what the first step loads
    print("ready", flush=True)
    axes_at = world_at = time.monotonic()  # noqa: TID251
    while (orders := read_orders()) is not None:
        now = time.monotonic()  # noqa: TID251
        for order in orders:
            robot.obey(order, now)
        axes_at, world_at = max(axes_at, now - BEHIND), max(world_at, now - BEHIND)
        for frame in emulated_axes.received(bus):
            for axis in robot.axes:
                emulated_axes.send(bus, axis.receive(frame, now))
        while axes_at + STEP <= now:
            axes_at += STEP
            for axis in robot.axes:
                emulated_axes.send(bus, axis.step(axes_at, STEP))
        if world_at + WORLD_STEP <= now:
            world_at += WORLD_STEP
            robot.step_world()
        for line in robot.news(now):
            print(line, flush=True)
        time.sleep(STEP)  # noqa: TID251
    print(json.dumps(robot.report()), flush=True)


@dataclass
class RobotProcess:
    """The robot as a process of its own.

    Attributes:
        process: of it.
        channel: of its bus.
        port: to which its scans are sent.
    """

    process: subprocess.Popen
    channel: str
    port: int

    @property
    def body(self):
        """The value of `body` in a robot file."""
        bus = f"interface: udp_multicast, channel: '{self.channel}', nodes: [0, 1]"
        return f"{{use: wheels, rate: 250 Hz, driver: {{use: odrive_can, {bus}}}}}"

    def await_line(self, word=""):
        """Wait for the next line that begins with a word, an answer for example; return it."""
        while line := self.process.stdout.readline():
            if line.startswith(word):
                return line
        raise AssertionError("the robot has ended")

    def order(self, **values):
        """Change the robot; from now on it is measured until it stands."""
        self.process.stdin.write(json.dumps(values) + "\n")
        self.process.stdin.flush()

    def end(self):
        """End it; what happened."""
        self.process.stdin.close()
        report = json.loads(self.await_line("{"))
        self.process.wait()
        return report


@contextmanager
def robot_process(mission):
    """Start a robot; it ends with the block."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    channel = free_channel()
    process = subprocess.Popen(
        [sys.executable, "-m", "tests.robots.motors.emulated_robot", channel, str(port), mission],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    try:
        assert process.stdout.readline() == "ready\n"
        yield RobotProcess(process, channel, port)
    finally:
        process.kill()
        process.wait()
        process.stdin.close()
        process.stdout.close()


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), sys.argv[3])
