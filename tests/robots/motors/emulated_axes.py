"""Emulated ODrive axes: inertia, friction, encoder noise, heartbeats, a watchdog, errors to inject.

    python -m tests.robots.motors.emulated_axes INTERFACE CHANNEL NODE...

As a process of its own it steps in real time and reads orders from standard input, one JSON object
in each line: attributes of all axes, or of one with `node`. It prints `ready`, and from then on a
line when all wheels begin to turn or stand still: word, time on CLOCK_MONOTONIC, turns so far.
"""

from __future__ import annotations

import json
import os
import select
import sys
import time
from dataclasses import dataclass
from math import copysign, exp
from random import Random

from robots.motors.can_simple import (
    AxisError,
    AxisState,
    BusVoltageCurrent,
    ClearErrors,
    EncoderEstimates,
    Errors,
    Estop,
    Heartbeat,
    SetAxisState,
    SetControllerMode,
    SetInputVelocity,
    decode,
    encode,
    identifier,
)

HEARTBEATS, ESTIMATES = 0.1, 0.01
"""Periods of the drive's cyclic messages, seconds: ODrive's defaults."""
STEP = 0.001


@dataclass
class EmulatedAxis:
    """One motor with a wheel. Velocities in turns/s, torques in N m, inertia in N m s² per turn.

    A standing armed axis holds; a disarmed one coasts: J dv/dt = -d v - c sign(v).
    """

    node: int
    inertia: float = 0.05
    damping: float = 0.05
    friction: float = 0.15
    gain: float = 5.0
    noise: float = 1e-4
    watchdog: float = 0.2
    voltage: float = 24.0
    is_calibrated: bool = True
    is_silent: bool = False
    is_deaf: bool = False
    is_stuck: bool = False
    standing_error: int = 0

    def __post_init__(self) -> None:
        self.position = self.velocity = 0.0
        self.state, self.mode = int(AxisState.IDLE), (3, 1)
        self.error = self.reason = self.result = 0
        self.wanted, self.torque, self.fed_at = 0.0, 0.0, 0.0
        self.obeyed = []
        self._random = Random(self.node)
        self._due = {Heartbeat: 0.013 * self.node, EncoderEstimates: 0.0}

    @property
    def is_armed(self) -> bool:
        return self.state == AxisState.CLOSED_LOOP_CONTROL

    def fail(self, error: int) -> None:
        self.error |= error
        if self.is_armed:
            self.reason, self.state, self.result = error, int(AxisState.IDLE), 3

    def receive(self, frame, now: float) -> list:
        """Take a frame (number, content, remote); return the answers."""
        number, content, is_remote = frame
        if self.is_deaf or number >> 5 != self.node:
            return []
        if is_remote:
            return self._answer(number & 0x1F)
        read = decode(number, content)
        if read is not None:
            self._obey(read[1], now)
        return []

    def _answer(self, command: int) -> list:
        if command == BusVoltageCurrent.COMMAND:
            return self._said(BusVoltageCurrent(self.voltage, 0.5))
        if command == Errors.COMMAND:
            return self._said(Errors(self.error, self.reason))
        return []

    def _obey(self, message, now: float) -> None:
        if isinstance(message, SetInputVelocity):
            self.wanted, self.torque = message.velocity, message.torque
            self.obeyed.append(message)
            self.fed_at = now
        elif isinstance(message, Estop):
            self.fail(AxisError.ESTOP_REQUESTED)
        elif isinstance(message, ClearErrors):
            self.error = self.standing_error
        elif isinstance(message, SetControllerMode):
            self.mode = (message.control, message.input)
        elif isinstance(message, SetAxisState):
            self._enter(message.state, now)

    def _enter(self, state: int, now: float) -> None:
        if state == AxisState.IDLE:
            self.state = state
        elif state == AxisState.CLOSED_LOOP_CONTROL and not self.error:
            self.fed_at = now
            self.result = 0 if self.is_calibrated else 14
            self.state = state if self.is_calibrated else self.state

    def step(self, now: float, period: float) -> list:
        """Advance; return the frames that are due."""
        if self.is_armed and self.watchdog and now - self.fed_at > self.watchdog:
            self.fail(AxisError.WATCHDOG_TIMER_EXPIRED)
        if self.voltage < 18.0:
            self.fail(AxisError.DC_BUS_UNDER_VOLTAGE)
        before = self.velocity
        if self.is_armed and self.mode == (2, 1):
            self.velocity = self._driven(before, period)
        else:
            self.velocity = self._rolled(before, 0.0, period)
        if self.is_stuck:
            self.velocity = 0.0
        self.position += period * (before + self.velocity) / 2.0
        found = []
        for kind, every in ((Heartbeat, HEARTBEATS), (EncoderEstimates, ESTIMATES)):
            if now >= self._due[kind]:
                self._due[kind] = max(self._due[kind] + every, now)
                found += self._said(self._cyclic(kind))
        return [] if self.is_silent else found

    def _driven(self, before: float, period: float) -> float:
        """The drive's proportional and feed-forward control; it holds a wheel that stands."""
        ahead = self.damping * self.wanted + copysign(self.friction, self.wanted)
        effort = self.gain * (self.wanted - before) + ahead
        after = (
            before
            + (effort - self.damping * before - copysign(self.friction, before or effort))
            * period
            / self.inertia
        )
        return 0.0 if self.wanted == 0.0 and abs(after) < 0.002 else after

    def _rolled(self, before: float, effort: float, period: float) -> float:
        final = -copysign(self.friction, before) / self.damping
        after = final + (before - final) * exp(-period * self.damping / self.inertia)
        return 0.0 if before * after <= 0.0 else after

    def _cyclic(self, kind):
        if kind is Heartbeat:
            return Heartbeat(self.error, self.state, self.result)
        noise = self._random.gauss
        return EncoderEstimates(
            self.position + noise(0.0, self.noise), self.velocity + noise(0.0, 10.0 * self.noise)
        )

    def _said(self, message) -> list:
        return [(identifier(self.node, type(message)), encode(message), False)]


def main(interface: str, channel: str, nodes: list[int]) -> None:
    import can

    from robots.motors.can_bus import BusAddress

    bus = can.Bus(**BusAddress(interface, channel).arguments())
    axes = [EmulatedAxis(node) for node in nodes]
    print("ready", flush=True)
    begin = time.monotonic()  # noqa: TID251
    stepped, turned = begin, False
    while True:
        for line in _lines():
            _change(bus, axes, json.loads(line))
        now = time.monotonic()  # noqa: TID251
        for number, content, remote in received(bus):
            for axis in axes:
                send(bus, axis.receive((number, content, remote), now))
        while stepped + STEP <= now:
            stepped += STEP
            for axis in axes:
                send(bus, axis.step(stepped, STEP))
        turns = any(axis.velocity for axis in axes)
        if turns != turned:
            turned = turns
            distance = " ".join(f"{axis.position:.5f}" for axis in axes)
            print("turns" if turns else "stands", f"{now:.6f}", distance, flush=True)
        time.sleep(STEP)  # noqa: TID251


_INPUT = b""


def _lines():
    global _INPUT
    if not select.select([0], [], [], 0.0)[0]:
        return []
    read = os.read(0, 4096)
    if not read:
        sys.exit()
    *lines, _INPUT = (_INPUT + read).split(b"\n")
    return lines


def _change(bus, axes, order) -> None:
    import can

    wanted = order.pop("node", None)
    if order.pop("bus_off", False):
        bus.send(can.Message(arbitration_id=0x40, is_error_frame=True, is_extended_id=False))
    error = order.pop("error", 0)
    stamp = time.monotonic()  # noqa: TID251
    speeds = []
    for axis in axes:
        speeds.append(f"{axis.position:.5f}:{axis.velocity:.4f}")
        if wanted in (None, axis.node):
            for name, value in order.items():
                assert hasattr(axis, name), name
                setattr(axis, name, value)
            if error:
                axis.fail(error)
    print("changed", f"{stamp:.6f}", *speeds, flush=True)


def received(bus):
    import can

    for _ in range(100):
        try:
            frame = bus.recv(0.0)
        except can.CanError:
            continue
        if frame is None:
            return
        if not frame.is_error_frame and not frame.is_extended_id and not frame.is_fd:
            yield frame.arbitration_id, bytes(frame.data), frame.is_remote_frame


def send(bus, frames) -> None:
    import can

    for number, content, _ in frames:
        bus.send(
            can.Message(arbitration_id=number, data=content, is_extended_id=False), timeout=0.1
        )


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], [int(node) for node in sys.argv[3:]])
