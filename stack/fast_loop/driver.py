"""Driver: the hardware side of the fast loop, by entry point of `treepilot.drivers`.

class Wheels(Driver):
    def open(self): ...                        # connect; may take seconds
    def exchange(self, command, feedback):     # once per cycle; must not block
        self.bus.send(command.speeds)
        feedback.speeds[:] = self.bus.speeds
    def close(self): ...                       # torque off, disconnect
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, ClassVar

from stack.drivetrain.wheel_loop import (
    ANGLES,
    EFFORTS,
    LEVEL,
    LINEAR,
    MEASURED_SPEEDS,
    SPEEDS,
    STAMPS,
    STEERING_ANGLES,
    STEERING_MEASURED,
    block,
)
from stack.plugins import named_class
from stack.types import FloatArray

GROUP = "treepilot.drivers"
BUILT_IN = {
    "emulated": "stack.fast_loop.emulated:Emulated",
    "mavlink": "robots.mavlink.driver:MavlinkDriver",
    "odrive_can": "robots.motors.odrive:OdriveCan",
}


class DriverCommand:
    """Setpoints of one cycle: views on the loop's state, the same object in each cycle.

    Attributes:
        now: seconds on the loop's monotonic clock at the start of the cycle.
        period: seconds since the last cycle, a multiple of the loop's period.
        twist: (3,) linear, angular and lateral velocity within the limits: m/s, rad/s, m/s.
        speeds: (n,) of the driven wheels, rad/s.
        efforts: (n,) of the driven wheels, in the driver's unit; 0 if no gains are set.
        steering: (2,) angles of the steered wheels, left and right, radians.
    """

    def __init__(self, state: FloatArray) -> None:
        self.now = self.period = 0.0
        self.twist = state[LINEAR : LINEAR + 3]
        self.speeds, self.efforts = block(state, SPEEDS), block(state, EFFORTS)
        self.steering = state[STEERING_ANGLES : STEERING_ANGLES + 2]
        self._level = state[LEVEL : LEVEL + 1]

    @property
    def level(self) -> int:
        """DRIVING, STOPPING (the setpoints slow down) or OFF: the driver gives no torque."""
        return int(self._level[0])


class DriverFeedback:
    """Measurements of one cycle: views on the loop's state. What is not measured stays as it was.

    Attributes:
        angles: (n,) of the driven wheels since the start, radians.
        speeds: (n,) of the driven wheels, rad/s.
        stamps: (n,) when they were measured, seconds on the loop's monotonic clock.
        steering: (2,) measured angles of the steered wheels, radians.
        problem: what does not work, in the device's own words; empty if the robot can drive. While
            it is set, the loop stops the robot and releases the wheels.
        is_ready: whether the wheels can follow; the setpoints stay at a standstill until then.
    """

    def __init__(self, state: FloatArray) -> None:
        self.angles, self.speeds = block(state, ANGLES), block(state, MEASURED_SPEEDS)
        self.stamps = block(state, STAMPS)
        self.steering = state[STEERING_MEASURED : STEERING_MEASURED + 2]
        self.problem, self.is_ready = "", True


@dataclass(frozen=True)
class DriverSetup:
    """What a driver is made for.

    Attributes:
        wheels: number of driven wheels.
        is_steered: whether it has two steered wheels.
        controls_efforts: whether gains are set: the driver shall apply efforts, not speeds.
        rate: cycles per second.
    """

    wheels: int
    is_steered: bool
    controls_efforts: bool
    rate: float


@dataclass(frozen=True)
class Lack:
    """What this machine lacks for a driver.

    Attributes:
        sentence: what is missing.
        remedy: the command that helps.
        is_device: whether it is hardware, which is missed only when the robot is to drive.
    """

    sentence: str
    remedy: str
    is_device: bool = False


@dataclass(frozen=True)
class NoParameters:
    """Parameters of a driver that has none."""


class Driver(ABC):
    """Hardware of one robot. It runs in the fast loop's process, and only there.

    Its module must import nothing heavy: no physics, no display, no other part of the brain. A
    driver has a watchdog in the hardware, which stops the motors if this process dies. An exception
    ends the loop: `close` is called, and the brain is told.

    Args:
        setup: of the loop.
        parameters: instance of `Parameters`.

    Attributes:
        Parameters: a frozen dataclass of `parameter(...)` fields.
    """

    Parameters: ClassVar[type] = NoParameters

    def __init__(self, setup: DriverSetup, parameters: Any) -> None:
        self.setup, self.parameters = setup, parameters

    @classmethod
    def lack(cls, parameters: Any) -> Lack | None:
        """Return what this machine lacks, without touching the hardware; None if nothing."""
        return None

    def open(self) -> None:  # noqa: B027 - some drivers have nothing to connect
        """Connect; may take seconds. The loop begins after it.

        Raises:
            BodyError: the hardware does not respond; in its own words.
        """

    @abstractmethod
    def exchange(self, command: DriverCommand, feedback: DriverFeedback) -> None:
        """Send setpoints and take measurements, once per cycle; must not block.

        Raises:
            BodyError: the hardware is lost.
        """

    def receive(self, message: bytes) -> None:  # noqa: B027 - most drivers get no messages
        """Take a message of the body, at most one in each cycle."""

    def messages(self) -> Iterable[bytes]:
        """Return encoded messages for the body since the last call; dropped if it does not read."""
        return ()

    def close(self) -> None:  # noqa: B027 - some drivers have nothing to close
        """Release the wheels and disconnect. It must not raise, and may be called without open."""


def driver_class(name: str) -> type[Driver]:
    """Return a driver by name.

    Raises:
        InputError: there is none of this name, or its module cannot be used.
    """
    return named_class("driver", name, GROUP, BUILT_IN, Driver)  # type: ignore[type-abstract]
