"""Signed frames: who is refused, and who cannot be locked out."""

import os
import struct
from hashlib import sha256

import pytest
from pymavlink.dialects.v20 import all as mav

from stack.errors import InputError
from stack.mavlink.signing import (
    EPOCH,
    MAX_STREAMS,
    Signing,
    make_key,
    read_key,
    signed_codecs,
    stamp_file,
)

KEY, OTHER = bytes(range(32)), bytes(32)
MINUTE = 6_000_000  # units of 10 microseconds
PING = mav.MAVLink_ping_message(1, 2, 0, 0)


class Now:
    """The time of day."""

    def __init__(self):
        self.seconds = EPOCH + 1000.0

    def __call__(self):
        return self.seconds


@pytest.fixture
def now():
    return Now()


def codec(now, key=KEY, system=255, **options):
    return signed_codecs(Signing(key, clock=now, **options))(system, 190)


def heard(receiver, frame):
    receiver.robust_parsing = True
    return [message.get_type() for message in receiver.parse_buffer(bytes(frame)) or ()]


def stamped(stamp, key=KEY, system=255, link=0):
    """A frame with a time stamp of one's choice, signed with a key."""
    sender = mav.MAVLink(None, system, 190)
    sender.signing.secret_key, sender.signing.sign_outgoing = key, True
    sender.signing.timestamp, sender.signing.link_id = stamp, link
    return PING.pack(sender)


def test_frames_with_the_key_are_accepted_once(now):
    sender, receiver = codec(now), codec(now, system=1)
    frames = [PING.pack(sender) for _ in range(3)]
    assert [heard(receiver, frame) for frame in frames] == [["PING"]] * 3
    assert [heard(receiver, frame) for frame in frames] == [["BAD_DATA"]] * 3  # replayed


def test_frames_without_the_key_are_refused(now):
    receiver = codec(now, system=1)
    assert heard(receiver, PING.pack(mav.MAVLink(None, 255, 190))) == ["BAD_DATA"]
    assert heard(receiver, PING.pack(codec(now, OTHER))) == ["BAD_DATA"]
    good = bytearray(PING.pack(codec(now)))
    good[-1] ^= 1
    assert heard(receiver, good) == ["BAD_DATA"]


def test_pymavlink_s_own_frames_are_accepted(now):
    """The format is that of the specification, not only our own."""
    assert heard(codec(now, system=1), stamped(1000 * 100_000)) == ["PING"]


def test_a_forged_frame_of_the_far_future_locks_nobody_out(now):
    sender, receiver = codec(now), codec(now, system=1)
    assert heard(receiver, PING.pack(sender)) == ["PING"]
    assert heard(receiver, stamped(2**48 - 1, OTHER)) == ["BAD_DATA"]
    assert heard(receiver, PING.pack(sender)) == ["PING"]
    victim = mav.MAVLink(None, 1, 190)  # what pymavlink does: the test knows the defect
    victim.signing.secret_key, victim.robust_parsing = KEY, True
    heard(victim, stamped(2**48 - 1, OTHER))
    assert heard(victim, PING.pack(sender)) == ["BAD_DATA"]


def test_a_new_stream_may_lag_a_minute(now):
    receiver, present = codec(now, system=1), 1000 * 100_000
    assert heard(receiver, stamped(present - MINUTE, system=5)) == ["PING"]
    assert heard(receiver, stamped(present - MINUTE - 1, system=6)) == ["BAD_DATA"]


def test_the_number_of_streams_is_limited(now):
    receiver = codec(now, system=1)
    frames = [stamped(1000 * 100_000, system=5, link=link) for link in range(MAX_STREAMS + 1)]
    assert sum(heard(receiver, frame) == ["PING"] for frame in frames) == MAX_STREAMS


@pytest.mark.parametrize("crashed", [True, False])
def test_frames_of_a_former_run_are_refused(now, tmp_path, crashed):
    store = tmp_path / "stamp"
    first = signed_codecs(running := Signing(KEY, store=store, clock=now))(1, 1)
    sender = codec(now)
    for _ in range(20):
        now.seconds += 1.0
        frame = PING.pack(sender)
        assert heard(first, frame) == ["PING"]
    if not crashed:
        running.close()
    second = codec(now, system=1, store=store)
    assert heard(second, frame) == ["BAD_DATA"]
    now.seconds += 11.0  # a stamp is stored up to ten seconds ahead
    assert heard(second, PING.pack(sender)) == ["PING"]


def test_outgoing_stamps_grow_and_follow_the_clock(now):
    sender = codec(now)

    def stamp():
        frame = PING.pack(sender)
        return struct.unpack("<Q", frame[-12:-6] + b"\0\0")[0]

    first, second = stamp(), stamp()
    assert (first, second) == (1000 * 100_000, 1000 * 100_000 + 1)
    now.seconds += 10.0
    assert stamp() == 1010 * 100_000


def test_a_key_is_a_private_file_of_64_digits(tmp_path):
    file = tmp_path / "robot.key"
    make_key(file)
    assert file.stat().st_mode & 0o777 == 0o600
    digits = file.read_bytes().strip()
    assert len(bytes.fromhex(digits.decode())) == 32
    assert read_key(file) == sha256(digits).digest()  # as MAVProxy's `signing key`
    with pytest.raises(InputError, match="exists"):
        make_key(file)
    os.chmod(file, 0o640)
    with pytest.raises(InputError, match=f"chmod 600 {file}"):
        read_key(file)
    os.chmod(file, 0o600)
    file.write_text("password\n")
    with pytest.raises(InputError, match="64 hexadecimal digits"):
        read_key(file)
    with pytest.raises(InputError, match="No such file"):
        read_key(tmp_path / "none")


def test_a_damaged_store_is_an_error(tmp_path, now):
    store = stamp_file(tmp_path / "robot.key")
    store.write_text("soon\n")
    with pytest.raises(InputError, match=r"robot.key.stamp holds no time stamp"):
        Signing(KEY, store=store, clock=now)
