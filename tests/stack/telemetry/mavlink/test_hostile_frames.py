"""Hostile frames: no crash, no order that they do not spell out, bounded queues."""

from pymavlink.dialects.v20 import all as mav

from stack.mavlink.signing import Signing, signed_codecs
from stack.telemetry.mavlink.commands import MAX_STATIONS
from stack.telemetry.mavlink.handover import MAX_COMMANDS
from tests.benchmarks.mavlink_fuzz import KINDS, fuzz

FRAMES = 20_000 // 3
"""`python -m tests.benchmarks.mavlink_fuzz` does the same with a million."""


def test_noise_and_damaged_frames_order_nothing(snapshot_at):
    assert not fuzz(FRAMES, snapshot_at(), mav.MAVLink(None), KINDS[:2]).orders


def test_odd_messages_neither_crash_nor_fill_queues(snapshot_at):
    outcome = fuzz(FRAMES, snapshot_at(), mav.MAVLink(None), KINDS[2:])
    assert outcome.understood == FRAMES
    assert outcome.orders.total() > 10  # some are commands: the frames do reach the vehicle
    assert outcome.waiting <= MAX_COMMANDS + MAX_STATIONS


def test_a_signed_link_understands_none_of_them(snapshot_at):
    codec = signed_codecs(Signing(bytes(32)))(1, 1)
    outcome = fuzz(FRAMES, snapshot_at(), codec)
    assert outcome.understood == 0 and not outcome.orders


def test_an_engine_that_is_stuck_gets_a_bounded_number_of_orders(rig):
    rig.is_slow = True
    rig.show(teleop=True)
    for number in range(3000):
        rig.vehicle.take(heard(mav.MAVLink_param_set_message(
            1, 1, b"CTL_CRUISE_SPEED", number / 10_000, 9
        )))  # fmt: skip
    assert rig.handover.waiting == MAX_COMMANDS
    rig.long(400, 0)
    assert rig.waiting[0].kind == "estop"  # before all others


def heard(message):
    (one,) = mav.MAVLink(None).parse_buffer(bytes(message.pack(mav.MAVLink(None, 255, 190))))
    return one
