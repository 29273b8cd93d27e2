"""CANSimple, the protocol of ODrive's motor drives with firmware 0.6: frames <-> messages.

The only place that knows layouts. An identifier of 11 bits has the node in the upper six and the
command in the lower five. All numbers are little-endian; turns are those of the motor. The layouts
are those of ODrive's DBC file, as in `can_simple_messages.hpp` and `odrive_enums.h` of the
repository odriverobotics/ros_odrive.
"""

from __future__ import annotations

import struct
from dataclasses import astuple, dataclass
from enum import IntEnum, IntFlag
from math import isfinite
from typing import ClassVar

NODES = 63
"""Largest number of a node."""


class AxisState(IntEnum):
    """States that are asked for; an axis has further ones."""

    IDLE = 1
    CLOSED_LOOP_CONTROL = 8


class AxisError(IntFlag):
    """What stops an axis."""

    INITIALIZING = 0x1
    SYSTEM_LEVEL = 0x2
    TIMING_ERROR = 0x4
    MISSING_ESTIMATE = 0x8
    BAD_CONFIG = 0x10
    DRV_FAULT = 0x20
    MISSING_INPUT = 0x40
    DC_BUS_OVER_VOLTAGE = 0x100
    DC_BUS_UNDER_VOLTAGE = 0x200
    DC_BUS_OVER_CURRENT = 0x400
    DC_BUS_OVER_REGEN_CURRENT = 0x800
    CURRENT_LIMIT_VIOLATION = 0x1000
    MOTOR_OVER_TEMP = 0x2000
    INVERTER_OVER_TEMP = 0x4000
    VELOCITY_LIMIT_VIOLATION = 0x8000
    POSITION_LIMIT_VIOLATION = 0x10000
    WATCHDOG_TIMER_EXPIRED = 0x1000000
    ESTOP_REQUESTED = 0x2000000
    SPINOUT_DETECTED = 0x4000000
    BRAKE_RESISTOR_DISARMED = 0x8000000
    THERMISTOR_DISCONNECTED = 0x10000000
    CALIBRATION_ERROR = 0x40000000


VELOCITY_CONTROL, PASSTHROUGH = 2, 1
"""Control mode and input mode: the drive controls the velocity, and takes it as it comes."""

RESULTS = (
    "SUCCESS", "BUSY", "CANCELLED", "DISARMED", "NO_RESPONSE", "POLE_PAIR_CPR_MISMATCH",
    "PHASE_RESISTANCE_OUT_OF_RANGE", "PHASE_INDUCTANCE_OUT_OF_RANGE", "UNBALANCED_PHASES",
    "INVALID_MOTOR_TYPE", "ILLEGAL_HALL_STATE", "TIMEOUT", "HOMING_WITHOUT_ENDSTOP",
    "INVALID_STATE", "NOT_CALIBRATED", "NOT_CONVERGING",
)  # fmt: skip
"""Of what was last asked of an axis, by number."""


@dataclass(frozen=True, slots=True)
class Message:
    """A message of one axis, or to it.

    Attributes:
        COMMAND: number of the command.
        LAYOUT: of the content.
    """

    COMMAND: ClassVar[int]
    LAYOUT: ClassVar[struct.Struct]


@dataclass(frozen=True, slots=True)
class Heartbeat(Message):
    """State of an axis: bits of `AxisError`, number of its state, number of the last result."""

    COMMAND = 0x01
    LAYOUT = struct.Struct("<IBB2x")
    error: int
    state: int
    result: int


@dataclass(frozen=True, slots=True)
class Estop(Message):
    """Disarm the axis at once."""

    COMMAND = 0x02
    LAYOUT = struct.Struct("")


@dataclass(frozen=True, slots=True)
class Errors(Message):
    """Active errors, and those that have disarmed the axis: bits of `AxisError`."""

    COMMAND = 0x03
    LAYOUT = struct.Struct("<II")
    active: int
    disarmed_by: int


@dataclass(frozen=True, slots=True)
class SetAxisState(Message):
    """Ask for a state."""

    COMMAND = 0x07
    LAYOUT = struct.Struct("<I4x")
    state: int


@dataclass(frozen=True, slots=True)
class EncoderEstimates(Message):
    """Position in turns, velocity in turns per second."""

    COMMAND = 0x09
    LAYOUT = struct.Struct("<ff")
    position: float
    velocity: float


@dataclass(frozen=True, slots=True)
class SetControllerMode(Message):
    """What the drive controls, and how it takes its input."""

    COMMAND = 0x0B
    LAYOUT = struct.Struct("<II")
    control: int
    input: int


@dataclass(frozen=True, slots=True)
class SetInputVelocity(Message):
    """Velocity in turns per second, torque that is added, in newton metres. Feeds the watchdog."""

    COMMAND = 0x0D
    LAYOUT = struct.Struct("<ff")
    velocity: float
    torque: float


@dataclass(frozen=True, slots=True)
class BusVoltageCurrent(Message):
    """Supply of the drive, volts and amperes."""

    COMMAND = 0x17
    LAYOUT = struct.Struct("<ff")
    voltage: float
    current: float


@dataclass(frozen=True, slots=True)
class ClearErrors(Message):
    """Forget the errors; `identify` lets the drive blink."""

    COMMAND = 0x18
    LAYOUT = struct.Struct("<B")
    identify: int = 0


MESSAGES: dict[int, type[Message]] = {
    kind.COMMAND: kind
    for kind in (
        Heartbeat, Estop, Errors, SetAxisState, EncoderEstimates, SetControllerMode,
        SetInputVelocity, BusVoltageCurrent, ClearErrors,
    )
}  # fmt: skip


def identifier(node: int, kind: type[Message]) -> int:
    """Return the identifier of frames of a kind, to or from a node."""
    return node << 5 | kind.COMMAND


def encode(message: Message) -> bytes:
    """Return the content of a frame."""
    return message.LAYOUT.pack(*astuple(message))


def decode(number: int, content: bytes) -> tuple[int, Message] | None:
    """Return the node and the message in a frame.

    Args:
        number: identifier of 11 bits.
        content: at most 8 bytes.

    Returns:
        None if it is not a message of this protocol: an unknown command, a wrong length, or a
        number that is not finite.
    """
    kind = MESSAGES.get(number & 0x1F)
    if kind is None or number >> 5 > NODES or len(content) != kind.LAYOUT.size:
        return None
    values = kind.LAYOUT.unpack(content)
    return (number >> 5, kind(*values)) if all(map(isfinite, values)) else None


def error_names(bits: int) -> str:
    """Return the names of errors, as ODrive's tools write them; unknown bits as a number."""
    names = [one.name or "" for one in AxisError if bits & one]
    unknown = bits & ~sum(AxisError)
    return " | ".join([*names, *([f"{unknown:#x}"] if unknown else [])]) or "no error"


def state_name(state: int) -> str:
    """Return the name of the state of an axis."""
    return AxisState(state).name if state in {*AxisState} else f"state {state}"


def result_name(result: int) -> str:
    """Return the name of the result of what was last asked of an axis."""
    return RESULTS[result] if result < len(RESULTS) else f"result {result}"
