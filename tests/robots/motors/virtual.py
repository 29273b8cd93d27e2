"""Brain, wheel loop, driver `odrive_can` and emulated axes on a virtual clock: exact and quick.

    python -m tests.robots.motors.virtual

prints what each fault of FAULTS leads to. The frames pass through a virtual bus of python-can.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import count
from math import inf, tau
from unittest import mock

import can

from robots.motors import odrive
from robots.motors.can_bus import BusAddress, CanBus
from stack.drivetrain.differential import Wheels
from stack.drivetrain.kernels import cycle
from stack.drivetrain.limits import STOP_DECELERATION, Limits
from stack.drivetrain.wheel_loop import COMMAND, LEVEL, PERIOD, SILENCE, STOP, loop_plan, loop_state
from stack.fast_loop.driver import DriverCommand, DriverFeedback, DriverSetup
from tests.robots.motors.emulated_axes import STEP, EmulatedAxis

RADIUS, SPEED, RATE = 0.1, 0.8, 250.0
SCOUT, STIFF = STOP_DECELERATION, 40.0
"""Decelerations, m/s²: of the robot scout, and one that stops the wheels in 0.02 s."""
_CHANNELS = count()


class World:
    """Two axes, a bus, a driver, the loop around it. Faults are its attributes and those of axes.

    Attributes:
        now: seconds.
        twist: what the brain commands.
        brain_lives: whether it does.
        loop_lives: whether the fast loop runs.
        cable: whether frames get through.
        stop: whether an emergency stop stands.
    """

    def __init__(self, deceleration=SCOUT, **parameters):
        self.now, self.twist, self._silent_since = 100.0, 0.0, 100.0
        self.brain_lives = self.loop_lives = self.cable = True
        self.stop = False
        channel = f"axes{next(_CHANNELS)}"
        self.bus = can.Bus(interface="virtual", channel=channel)
        self.axes = [EmulatedAxis(0), EmulatedAxis(1)]
        limits = Limits(linear_speed=SPEED, linear_acceleration=1.5, stop_deceleration=deceleration)
        drive = Wheels(("l",), ("r",), RADIUS, 0.4).drivetrain(limits)
        self.plan = loop_plan(drive, 0.3, 2.0)
        self.state = loop_state(self.plan, 1.0 / RATE)
        self.command, self.feedback = DriverCommand(self.state), DriverFeedback(self.state)
        world = self

        class Wire(CanBus):
            def receive(self, timeout=0.0):
                world.let_pass(timeout)
                return super().receive(0.0)

        values = odrive.OdriveParameters("virtual", channel, **parameters)
        assert values.address == BusAddress("virtual", channel)
        self._clock = mock.patch.object(odrive, "monotonic", lambda: self.now)
        with self._clock, mock.patch.object(odrive, "CanBus", Wire):
            self.driver = odrive.OdriveCan(DriverSetup(2, False, False, RATE), values)
            self.driver.open()

    def let_pass(self, seconds):
        """Advance the axes."""
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            while (frame := self.bus.recv(0.0)) is not None:
                if frame.is_error_frame or not self.cable:
                    continue
                heard = (frame.arbitration_id, bytes(frame.data), frame.is_remote_frame)
                for axis in self.axes:
                    self._say(axis.receive(heard, self.now))
            for axis in self.axes:
                self._say(axis.step(self.now, STEP))

    def _say(self, frames):
        for number, content, _ in frames if self.cable else ():
            self.bus.send(can.Message(arbitration_id=number, data=content, is_extended_id=False))

    def run(self, seconds):
        """Let time pass, cycle by cycle."""
        for _ in range(round(seconds * RATE)):
            self.cycle()

    def cycle(self):
        """Let one cycle pass."""
        self.let_pass(1.0 / RATE)
        if not self.loop_lives:
            return
        if self.brain_lives:
            self._silent_since = self.now
        state = self.state
        state[PERIOD], state[SILENCE] = 1.0 / RATE, self.now - self._silent_since
        state[STOP] = self.stop or bool(self.feedback.problem)
        state[COMMAND] = self.twist if self.feedback.is_ready else 0.0
        cycle(self.plan, state)
        self.command.now, self.command.period = self.now, 1.0 / RATE
        self.driver.exchange(self.command, self.feedback)

    @property
    def speeds(self):
        """Of the wheels' rims, m/s."""
        return [tau * RADIUS * axis.velocity for axis in self.axes]

    def close(self):
        """Close both ends of the bus."""
        with self._clock:
            self.driver.close()
        self.bus.shutdown()


@dataclass(frozen=True)
class Stop:
    """What followed a fault.

    Attributes:
        noticed: seconds until the loop began to stop; inf: it did not, the drive stopped by itself.
        stood: seconds until both wheels stood.
        distance: metres that the wheels rolled until then, the longer one.
        problem: what the driver said.
    """

    noticed: float
    stood: float
    distance: float
    problem: str


def _bus_off(world):
    world.bus.send(can.Message(arbitration_id=0x40, is_error_frame=True, is_extended_id=False))
    world.cable = False


FAULTS: dict[str, Callable[[World], None]] = {
    "motor error on one axis": lambda world: world.axes[1].fail(0x20),
    "cable of one axis off": lambda world: world.axes[1].__dict__.update(
        is_silent=True, is_deaf=True
    ),
    "CAN cable off": lambda world: setattr(world, "cable", False),
    "controller bus-off": _bus_off,
    "supply below `least_voltage`": lambda world: [
        setattr(axis, "voltage", 20.0) for axis in world.axes
    ],
    "supply below the drive's own limit": lambda world: [
        setattr(axis, "voltage", 17.0) for axis in world.axes
    ],
    "brain frozen": lambda world: setattr(world, "brain_lives", False),
    "fast loop frozen or killed": lambda world: setattr(world, "loop_lives", False),
}


def stop_after(
    fault: Callable[[World], None], deceleration: float = SCOUT, gain: float = 5.0
) -> Stop:
    """Drive at SPEED, let a fault happen, and return how the robot stops."""
    world = World(deceleration, least_voltage=21.0)
    for axis in world.axes:
        axis.gain = gain
    try:
        world.twist = SPEED
        world.run(2.0)
        assert min(world.speeds) > 0.97 * SPEED
        began, noticed = world.now, inf
        places = [axis.position for axis in world.axes]
        fault(world)
        while any(world.speeds):
            world.cycle()
            if world.state[LEVEL] != 0 and noticed == inf:
                noticed = world.now - began
            assert world.now - began < 10.0
        rolled = max(
            abs(axis.position - place) for axis, place in zip(world.axes, places, strict=True)
        )
        stop = Stop(noticed, world.now - began, tau * RADIUS * rolled, world.feedback.problem)
        world.run(3.0)
        assert not any(world.speeds)
        return stop
    finally:
        world.close()


def table() -> str:
    """Rows for docs/rovers.md."""
    rows = []
    for name, fault in FAULTS.items():
        stop = stop_after(fault)
        noticed = "-" if stop.noticed == inf else f"{stop.noticed:.2f} s"
        rows.append(
            f"| {name} | {noticed} | {stop.stood:.2f} s | {stop.distance:.2f} m |"
            f" {stop.problem or '-'} |"
        )
    return "\n".join(rows)


if __name__ == "__main__":
    print(table())
