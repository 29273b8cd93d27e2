"""Driver `odrive_can`: wheels on ODrive's motor drives, over CAN (CANSimple, firmware 0.6).

The drive controls the velocity; the fast loop sends setpoints, which feed the drive's watchdog. A
fault stands until the body asks to forget it (CLEAR): an axis that has failed never starts again by
itself.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from time import monotonic  # noqa: TID251 - the clock of the fast loop
from typing import Any

from robots.motors.axis import Axis
from robots.motors.can_bus import BusAddress, CanBus
from robots.motors.can_simple import (
    NODES,
    PASSTHROUGH,
    VELOCITY_CONTROL,
    AxisError,
    AxisState,
    BusVoltageCurrent,
    ClearErrors,
    Errors,
    Estop,
    Message,
    SetAxisState,
    SetControllerMode,
    SetInputVelocity,
    error_names,
)
from stack.drivetrain.wheel_loop import OFF
from stack.errors import BodyError, InputError, ParameterError
from stack.fast_loop.driver import Driver, DriverCommand, DriverFeedback, DriverSetup, Lack
from stack.optional_packages import PYTHON_CAN
from stack.parameters import parameter

CLEAR = b"C"
"""What the body sends to forget all faults."""

SUPPLY, SUPPLY_KIND = struct.Struct("=cdff"), b"S"
"""What the body gets: its kind, time on the loop's clock, volts and amperes of the supply."""

RETRY, ENGAGES_WITHIN, DISARMS_WITHIN = 0.1, 3.0, 0.5
"""Seconds between two requests of a state; within which it must be reached, and otherwise: it is a
fault; the axis is disarmed by Estop."""

ASKS_EVERY, LOW_FOR = 0.5, 0.5
"""Seconds between two requests of the supply; for which a low voltage is no fault."""

IN_FLIGHT, GAP = 0.02, 0.1
"""Seconds for which what an axis says may be older than what it was told; between two cycles after
which silence counts again: the loop itself did not listen."""


@dataclass(frozen=True)
class OdriveParameters:
    """Motor drives on a CAN bus."""

    interface: str = parameter(
        "socketcan", help="kind of CAN interface: a name of python-can, as socketcan or slcan"
    )
    channel: str = parameter("can0", help="of the interface; ADDRESS:PORT for udp_multicast")
    bitrate: int = parameter(
        0, "Hz", at_least=0, at_most=1_000_000, help="of the bus; 0: as the system has set it"
    )
    nodes: tuple[int, ...] = parameter(
        (0, 1), at_least=0, at_most=NODES,
        help="node_id of the axis of each driven wheel: those of the left side, then the right",
    )  # fmt: skip
    turns: tuple[float, ...] = parameter(
        (), help="motor turns for one turn of each wheel forward; negative: mounted the other way"
        " round; without: 1"
    )  # fmt: skip
    setpoints: float = parameter(
        100.0, "Hz", at_least=20.0, at_most=1000.0, help="setpoints per second for each axis"
    )
    watchdog: float = parameter(
        0.2, "s", at_least=0.05, at_most=1.0,
        help="watchdog_timeout of the drives, which is tried before the robot drives",
    )  # fmt: skip
    silent_after: float = parameter(
        0.3, "s", at_least=0.05, at_most=1.0,
        help="time without a heartbeat or encoder estimate of an axis that is a fault",
    )  # fmt: skip
    least_voltage: float = parameter(
        0.0, "V", at_least=0.0, help="voltage of the supply below which the robot stops"
    )
    answers_within: float = parameter(
        2.0, "s", above=0.0, at_most=60.0, help="time in which each axis must be heard at the start"
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "nodes", tuple(self.nodes))  # files give lists
        object.__setattr__(self, "turns", tuple(self.turns) or (1.0,) * len(self.nodes))
        if len(set(self.nodes)) != len(self.nodes):
            raise ParameterError("nodes", f"each axis has its own, got {list(self.nodes)}")
        if len(self.turns) != len(self.nodes) or not all(self.turns):
            sentence = f"expected {len(self.nodes)} numbers other than 0, got {list(self.turns)}"
            raise ParameterError("turns", sentence)
        if 1.0 / self.setpoints > self.watchdog / 2.0:
            sentence = f"{self.watchdog:g} s is less than two periods of setpoints"
            raise ParameterError("watchdog", sentence)
        self.address.arguments()

    @property
    def address(self) -> BusAddress:
        """Of the bus."""
        return BusAddress(self.interface, self.channel, self.bitrate)


class OdriveCan(Driver):
    """Sends velocities, and takes encoder estimates, heartbeats and the voltage of the supply."""

    Parameters = OdriveParameters

    def __init__(self, setup: DriverSetup, parameters: Any) -> None:
        super().__init__(setup, parameters)
        p: OdriveParameters = parameters
        if setup.is_steered:
            raise InputError("the driver 'odrive_can' cannot steer: the robot has steered wheels")
        if len(p.nodes) != setup.wheels:
            raise InputError(f"the robot has {setup.wheels} driven wheels, got nodes {[*p.nodes]}")
        self.axes = [Axis(node, turns) for node, turns in zip(p.nodes, p.turns, strict=True)]
        self._by_node = {axis.node: axis for axis in self.axes}
        self._bus: CanBus | None = None
        self._engaging_since: float | None = None
        self._released_since: float | None = None
        self._is_engaged, self._clears, self._fault = False, False, ""
        self._last = self._listens_since = 0.0
        self._setpoint_due = self._state_due = self._supply_due = 0.0
        self._low_since: float | None = None
        self._outbox: list[bytes] = []

    @classmethod
    def lack(cls, parameters: Any) -> Lack | None:
        """Return what this machine lacks: python-can, the interface, or the right to use it."""
        if not PYTHON_CAN.is_installed:
            return Lack(f"the driver 'odrive_can' needs {PYTHON_CAN.absence}", PYTHON_CAN.hint)
        problem = parameters.address.problem()
        return None if problem is None else Lack(problem[0], problem[1], is_device=True)

    def open(self) -> None:
        """Find all axes, clear their errors, and try their watchdogs.

        Raises:
            InputError: python-can is not installed.
            BodyError: an axis is missing, does not enter closed loop control, or has no watchdog.
        """
        p = self.parameters
        self._bus = CanBus(p.address, p.nodes)
        self._await(
            lambda axis: axis.heartbeat is not None, p.answers_within,
            lambda axis: f"no heartbeat of node {axis.node} on {p.address} within"
            f" {p.answers_within:g} s; look at its power, cable, node_id and bit rate",
        )  # fmt: skip
        self._await(
            lambda axis: axis.estimated_at > 0.0, ENGAGES_WITHIN,
            lambda axis: f"node {axis.node} sends no encoder estimates; set"
            " can.encoder_msg_rate_ms = 10 in config of the axis, by odrivetool",
        )  # fmt: skip
        self._clear_errors()
        self._try_watchdogs()
        self._clear_errors()
        for axis in self.axes:
            axis.forget()

    def exchange(self, command: DriverCommand, feedback: DriverFeedback) -> None:
        """Read what has come, send what is due."""
        now = command.now
        if now - self._last > GAP:
            self._listens_since = now
        self._last = now
        for node, message in self._open_bus.receive():
            self._take(node, message, now)
        if command.level == OFF:
            self._release(now)
        else:
            self._released_since = None
            self._engage(now)
        self._watch(now)
        if now >= self._setpoint_due:
            self._setpoint_due = max(self._setpoint_due + 1.0 / self.parameters.setpoints, now)
            self._send_setpoints(command, now)
        if now >= self._supply_due:
            self._supply_due = now + ASKS_EVERY
            self._open_bus.request(self.axes[0].node, BusVoltageCurrent, now)
        for wheel, axis in enumerate(self.axes):
            feedback.angles[wheel], feedback.speeds[wheel] = axis.angle, axis.speed
            feedback.stamps[wheel] = axis.estimated_at
        feedback.is_ready = self._is_engaged
        feedback.problem = self.fault

    def receive(self, message: bytes) -> None:
        """Forget all faults, if the body asks for it; the axes are then armed again."""
        if message != CLEAR:
            return
        self._open_bus.forget()
        for axis in self.axes:
            axis.forget()
        self._fault, self._clears, self._is_engaged = "", True, False
        self._engaging_since = self._low_since = None

    @property
    def fault(self) -> str:
        """What stops the robot; it stands until the body asks to forget it."""
        return self._fault or next((axis.problem for axis in self.axes if axis.problem), "")

    def messages(self) -> Iterable[bytes]:
        """Return the state of the supply, when it has come."""
        found, self._outbox = self._outbox, []
        return found

    def close(self) -> None:
        """Release the wheels and disconnect; an axis that does not obey is disarmed by Estop."""
        bus, self._bus = self._bus, None
        if bus is None:
            return
        limit = monotonic() + DISARMS_WITHIN
        asked = 0.0
        while (now := monotonic()) < limit and any(axis.is_closed_loop for axis in self.axes):
            if now > asked + RETRY:
                asked = now
                for axis in self.axes:
                    bus.send(axis.node, SetInputVelocity(0.0, 0.0), now)
                    bus.send(axis.node, SetAxisState(AxisState.IDLE), now)
            for node, message in bus.receive(0.01):
                self._take(node, message, now)
        for axis in self.axes:
            if axis.is_closed_loop:
                bus.send(axis.node, Estop(), monotonic())
        bus.close()

    @property
    def _open_bus(self) -> CanBus:
        if self._bus is None:
            raise BodyError("the CAN bus is not open")
        return self._bus

    # Each cycle.

    def _engage(self, now: float) -> None:
        """Bring all axes into closed loop control; while a fault stands, none."""
        if self._is_engaged or self.fault:
            return
        if self._engaging_since is None:
            self._engaging_since, self._state_due = now, now
        said = self._engaging_since + IN_FLIGHT
        waiting = [axis for axis in self.axes if not axis.is_closed_loop or axis.heard_at < said]
        if not waiting and not self._clears:
            self._is_engaged, self._engaging_since = True, None
        elif now - self._engaging_since > ENGAGES_WITHIN:
            self._fault = waiting[0].refusal if waiting else "the errors could not be cleared"
        elif now >= self._state_due:
            self._state_due = now + RETRY
            for axis in self.axes if self._clears else waiting:
                self._arm(axis, now)
            self._clears = False

    def _arm(self, axis: Axis, now: float) -> None:
        bus = self._open_bus
        if self._clears:
            bus.send(axis.node, ClearErrors(), now)
        bus.send(axis.node, SetControllerMode(VELOCITY_CONTROL, PASSTHROUGH), now)
        bus.send(axis.node, SetInputVelocity(0.0, 0.0), now)
        bus.send(axis.node, SetAxisState(AxisState.CLOSED_LOOP_CONTROL), now)

    def _release(self, now: float) -> None:
        """Bring all axes to idle."""
        self._is_engaged, self._engaging_since = False, None
        if self._released_since is None:
            self._released_since, self._state_due = now, now
        if now < self._state_due:
            return
        self._state_due = now + RETRY
        late = now - self._released_since > DISARMS_WITHIN
        for axis in self.axes:
            if axis.is_closed_loop:
                request = Estop() if late else SetAxisState(AxisState.IDLE)
                self._open_bus.send(axis.node, request, now)

    def _watch(self, now: float) -> None:
        """Notice faults; the first one stands."""
        settled = self._engaging_since is None and not self._clears
        for axis in self.axes:
            left = axis.has_left
            axis.watch(
                now, self._listens_since, self.parameters.silent_after,
                driven=self._is_engaged, settled=settled,
            )  # fmt: skip
            if axis.has_left and not left:
                self._open_bus.request(axis.node, Errors, now)
        low = self._low_since is not None and now - self._low_since > LOW_FOR
        shared = self._open_bus.problem(now) or (self._low_voltage if low else "")
        self._fault = self._fault or shared
        if self.fault:
            self._is_engaged = False

    def _send_setpoints(self, command: DriverCommand, now: float) -> None:
        """Also to axes that are idle or have a fault: it feeds their watchdogs."""
        drives = command.level != OFF and self._engaging_since is None
        for wheel, axis in enumerate(self.axes):
            speed = effort = 0.0
            if drives:
                speed, effort = float(command.speeds[wheel]), float(command.efforts[wheel])
            self._open_bus.send(axis.node, SetInputVelocity(*axis.to_motor(speed, effort)), now)

    def _take(self, node: int, message: Message, now: float) -> None:
        self._by_node[node].take(message, now)
        if isinstance(message, BusVoltageCurrent):
            self._outbox.append(SUPPLY.pack(SUPPLY_KIND, now, message.voltage, message.current))
            least = self.parameters.least_voltage
            self._low_voltage = f"the supply has {message.voltage:.1f} V, less than {least:g} V"
            if message.voltage >= least:
                self._low_since = None
            elif self._low_since is None:
                self._low_since = now

    _low_voltage = ""

    # Before the run.

    def _try_watchdogs(self) -> None:
        """Stop feeding the watchdogs of standing axes; each must disarm its axis in time."""
        now = monotonic()
        for axis in self.axes:
            self._arm(axis, now)
        seen: set[int] = set()
        limit = now + ENGAGES_WITHIN + self.parameters.watchdog
        while monotonic() < limit and len(seen) < len(self.axes):
            for axis in self._heard():
                if axis.error & AxisError.WATCHDOG_TIMER_EXPIRED:
                    seen.add(axis.node)
        for axis in self.axes:
            if axis.node in seen:
                continue
            if not axis.is_closed_loop:
                raise BodyError(axis.refusal)
            self._tell(SetAxisState(AxisState.IDLE))
            raise BodyError(
                f"node {axis.node} has no watchdog: the robot would drive on if this computer"
                f" stopped; set enable_watchdog = True and watchdog_timeout ="
                f" {self.parameters.watchdog:g} in config of the axis, by odrivetool"
            )

    def _clear_errors(self) -> None:
        self._tell(SetInputVelocity(0.0, 0.0))  # a watchdog that is not fed is the next error
        self._tell(ClearErrors())
        since = monotonic() + IN_FLIGHT
        self._await(
            lambda axis: not axis.error and axis.heard_at > since, ENGAGES_WITHIN,
            lambda axis: f"the errors of node {axis.node} stand: {error_names(axis.error)}",
            SetInputVelocity(0.0, 0.0),
        )  # fmt: skip

    def _tell(self, message: Message) -> None:
        for axis in self.axes:
            self._open_bus.send(axis.node, message, monotonic())

    def _heard(self) -> Iterator[Axis]:
        for node, message in self._open_bus.receive(0.01):
            self._take(node, message, monotonic())
            yield self._by_node[node]

    def _await(
        self, ready: Callable[[Axis], bool], limit: float, words: Callable[[Axis], str],
        feed: Message | None = None,
    ) -> None:  # fmt: skip
        """Wait until all axes are ready; BodyError with the words of the first that is not."""
        until = monotonic() + limit
        while missing := [axis for axis in self.axes if not ready(axis)]:
            if monotonic() > until:
                raise BodyError(words(missing[0]))
            if feed is not None:
                self._tell(feed)
            for _ in self._heard():
                pass
