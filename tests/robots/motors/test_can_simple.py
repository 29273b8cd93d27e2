"""CANSimple: layouts against frames written by hand, and round trips of every message."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from robots.motors.can_simple import (
    MESSAGES,
    NODES,
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
    error_names,
    identifier,
    result_name,
    state_name,
)

KINDS = sorted(MESSAGES.values(), key=lambda kind: kind.COMMAND)
NUMBERS = {
    "I": st.integers(0, 2**32 - 1), "B": st.integers(0, 255),
    "f": st.floats(width=32, allow_nan=False, allow_infinity=False),
}  # fmt: skip


def messages(kind):
    """Any message of a kind."""
    return st.builds(kind, *(NUMBERS[one] for one in kind.LAYOUT.format if one in NUMBERS))


@given(st.integers(0, NODES), st.one_of(*map(messages, KINDS)))
def test_every_message_survives_a_round_trip(node, message):
    number = identifier(node, type(message))
    assert number < 2**11
    assert decode(number, encode(message)) == (node, message)


@pytest.mark.parametrize(
    ("number", "content", "expected"),
    [
        # Node 3: 3 << 5 = 0x60. 1.5 is 0x3FC00000, -0.25 is 0xBE800000 (IEEE 754).
        (0x61, "00020000 08 00 00 00", Heartbeat(0x200, 8, 0)),
        (0x61, "00000001 01 03 01 00", Heartbeat(0x1000000, 1, 3)),
        (0x62, "", Estop()),
        (0x63, "00000000 00000001", Errors(0, 0x1000000)),
        (0x67, "08000000 00000000", SetAxisState(AxisState.CLOSED_LOOP_CONTROL)),
        (0x69, "0000c03f 000080be", EncoderEstimates(1.5, -0.25)),
        (0x6B, "02000000 01000000", SetControllerMode(2, 1)),
        (0x6D, "000080be 0000c03f", SetInputVelocity(-0.25, 1.5)),
        (0x77, "0000c041 0000c03f", BusVoltageCurrent(24.0, 1.5)),
        (0x78, "00", ClearErrors()),
    ],
)
def test_layouts_are_those_of_the_documentation(number, content, expected):
    assert decode(number, bytes.fromhex(content)) == (3, expected)
    written = bytes.fromhex(content)
    if isinstance(expected, Heartbeat):  # the flag of trajectories is not used
        written = written[:6] + b"\0\0"
    assert encode(expected) == written


@given(st.integers(0, 2**11 - 1), st.binary(max_size=8))
def test_other_frames_are_no_messages(number, content):
    read = decode(number, content)
    kind = MESSAGES.get(number & 0x1F)
    fits = kind is not None and len(content) == kind.LAYOUT.size
    if fits and kind.LAYOUT.format == "<ff":  # exponent of all ones: infinite, or not a number
        fits = all(bits & 0x7F800000 != 0x7F800000 for bits in struct.unpack("<II", content))
    assert (read is not None) == fits


def test_names():
    both = AxisError.DC_BUS_UNDER_VOLTAGE | AxisError.WATCHDOG_TIMER_EXPIRED
    assert error_names(both) == "DC_BUS_UNDER_VOLTAGE | WATCHDOG_TIMER_EXPIRED"
    assert error_names(0x20000080) == "0x20000080"
    assert (error_names(0), state_name(8)) == ("no error", "CLOSED_LOOP_CONTROL")
    assert (state_name(6), result_name(14), result_name(99)) == (
        "state 6", "NOT_CALIBRATED", "result 99",
    )  # fmt: skip
