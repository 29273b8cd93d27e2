"""A rover link and emulated rovers on a virtual clock, connected in memory: exact and quick."""

from __future__ import annotations

from math import pi

from pymavlink.dialects.v20 import all as dialect

from robots.mavlink.driver import WANTED
from robots.mavlink.rover_link import STAND, RoverLink
from stack.mavlink.address import MavlinkAddress
from stack.mavlink.link import Counters, Received
from tests.robots.mavlink.emulated_rover import EmulatedRover, Settings

CYCLE = 0.01


class Wire:
    """Stands for a `Link`: frames pass through real codecs to and from the rovers."""

    dialect = dialect

    def __init__(self, world, system, component):
        self._world, self.counters = world, Counters()
        self._packing = dialect.MAVLink(None, system, component)
        self._parsing = dialect.MAVLink(None)
        self._parsing.robust_parsing = True
        self._come = []

    def send(self, message):
        if self._world.broken:
            raise OSError(5, "Input/output error")
        frame = bytes(message.pack(self._packing))
        self._packing.seq = (self._packing.seq + 1) % 256
        for rover in self._world.rovers:
            rover.take(frame)
        return True

    def receive(self, timeout):
        if self._world.broken:
            raise OSError(5, "Input/output error")
        now = self._world.now
        return [
            Received(message, now)
            for rover in self._world.rovers
            for frame in rover.step()
            for message in self._parsing.parse_buffer(frame) or []
        ]

    def close(self):
        pass


class World:
    """Virtual time, rovers and a link. `run` lets time pass."""

    def __init__(self, *settings, **options):
        self.now, self.broken = 100.0, False
        self.rovers = [EmulatedRover(one, self.time) for one in settings or [Settings()]]
        self.link = RoverLink(
            MavlinkAddress("udpin", "127.0.0.1", 14550), own_system=245, wanted=WANTED,
            now=self.now, open_link=lambda address, **ids: self._opened(**ids), **options,
        )  # fmt: skip
        self.received = []

    def _opened(self, system, component, make_codec):
        if self.broken:
            raise OSError(2, "No such file or directory")
        return Wire(self, system, component)

    def time(self):
        return self.now

    @property
    def rover(self):
        return self.rovers[0]

    def run(self, seconds, order=STAND, each=lambda: None):
        """Cycle for some seconds with an order."""
        for _ in range(round(seconds / CYCLE)):
            self.now += CYCLE
            self.received += self.link.cycle(self.now, order)
            each()

    def run_until(self, condition, order=STAND, longest=20.0):
        """Cycle until something is so; return the seconds that it took."""
        began = self.now
        while not condition():
            assert self.now - began < longest, f"not within {longest} s: {self.link.phase}"
            self.run(CYCLE, order)
        return self.now - began


def heading_of(rover):
    """Heading in the odom frame of a rover that faced north at first."""
    return (-rover.yaw + pi) % (2 * pi) - pi
