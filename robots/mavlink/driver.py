"""Driver `mavlink`: holds the link to a rover in the process of the fast loop.

So a rover gets its setpoints at a steady rate, and stops when the step loop is frozen or killed.
The driver hands the rover's messages to the brain as they came, with their times of arrival, and
the state of the link; the brain sends the number of the engagement and estimates of the pose.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path
from time import monotonic, sleep  # noqa: TID251 - a real robot's clock
from typing import Any

from robots.mavlink.estimates import SentEstimate
from robots.mavlink.parameters import MavlinkParameters
from robots.mavlink.rover_link import Order, Phase, RoverLink
from stack.fast_loop.driver import Driver, DriverCommand, DriverFeedback, DriverSetup
from stack.mavlink.address import read_address
from stack.mavlink.signing import Signing, read_key, signed_codecs, stamp_file

WANTED = (
    (30, 20.0),  # ATTITUDE
    (32, 20.0),  # LOCAL_POSITION_NED
    (9000, 20.0),  # WHEEL_DISTANCE
    (27, 50.0),  # RAW_IMU
    (105, 50.0),  # HIGHRES_IMU
    (330, 10.0),  # OBSTACLE_DISTANCE
    (132, 10.0),  # DISTANCE_SENSOR
    (147, 1.0),  # BATTERY_STATUS
    (1, 1.0),  # SYS_STATUS
)
"""Messages that the rover is asked to send, by id, and their rates, Hz."""

FRAMES, STATE, ENGAGEMENT, ESTIMATE = b"F", b"S", b"N", b"E"
"""First byte of what driver and brain send each other."""

STATE_PERIOD = 0.1
CLOSING, POLL = 3.0, 0.02
"""Longest time, seconds, to stop and disarm the rover at the end, and between two cycles then."""

_FRAME = struct.Struct("=dH")
_NUMBER = struct.Struct("=I")


class MavlinkDriver(Driver):
    """Calls the rover link in each cycle."""

    Parameters = MavlinkParameters

    def __init__(self, setup: DriverSetup, parameters: Any) -> None:
        super().__init__(setup, parameters)
        p: MavlinkParameters = parameters
        self._signing = _signing(Path(p.key)) if p.key else None
        self.link = RoverLink(
            read_address(p.connect, signed=bool(p.key)), own_system=p.own_system, system=p.system,
            autopilot=p.autopilot, wanted=WANTED, origin=p.origin, now=monotonic(),
            make_codec=None if self._signing is None else signed_codecs(self._signing),
        )  # fmt: skip
        self._engagement = 0
        self._estimate: SentEstimate | None = None
        self.link.estimate = self._message
        self._outbox: list[bytes] = []
        self._state, self._state_due = b"", 0.0

    def exchange(self, command: DriverCommand, feedback: DriverFeedback) -> None:
        """Receive, send what is due, and keep the rover's messages for the brain."""
        order = Order(float(command.twist[0]), float(command.twist[1]), self._engagement)
        received = self.link.cycle(command.now, order)
        if received:
            self._outbox.append(packed_frames((one.at, one.message) for one in received))
        state = packed_state(self.link)
        if state != self._state or command.now >= self._state_due:
            self._state, self._state_due = state, command.now + STATE_PERIOD
            self._outbox.append(STATE + state)

    def receive(self, message: bytes) -> None:
        """Take an engagement or an estimate."""
        if message[:1] == ENGAGEMENT:
            (self._engagement,) = _NUMBER.unpack(message[1:])
        elif message[:1] == ESTIMATE:
            self._estimate = SentEstimate.unpacked(message[1:])

    def messages(self) -> Iterable[bytes]:
        """Return the rover's messages and the state of the link."""
        found, self._outbox = self._outbox, []
        return found

    def close(self) -> None:
        """Stop and disarm the rover, and disconnect."""
        until = monotonic() + CLOSING
        while self.link.phase in (Phase.ENGAGING, Phase.DRIVING, Phase.RELEASING):
            self.link.cycle(monotonic(), Order())
            if monotonic() > until:
                break
            sleep(POLL)
        self.link.close()
        if self._signing is not None:
            self._signing.close()

    def _message(self, dialect: Any, now: float) -> Any | None:
        estimate = self._estimate
        return (
            None if estimate is None else estimate.message(self.parameters.estimate, dialect, now)
        )


def _signing(key: Path) -> Signing:
    """Signatures of this side; its stamps are its own, though the rover may use the same file."""
    return Signing(read_key(key), store=stamp_file(key.with_name(f"{key.name}.body")))


def packed_frames(messages: Iterable[tuple[float, Any]]) -> bytes:
    """Return messages, each with its time of arrival, as bytes for the brain."""
    parts = [FRAMES]
    for at, message in messages:
        frame = bytes(message.get_msgbuf())
        parts += [_FRAME.pack(at, len(frame)), frame]
    return b"".join(parts)


def unpacked_frames(content: bytes) -> Iterator[tuple[float, bytes]]:
    """Yield the time of arrival and the bytes of each message."""
    place = len(FRAMES)
    while place < len(content):
        at, length = _FRAME.unpack_from(content, place)
        place += _FRAME.size
        yield at, content[place : place + length]
        place += length


def packed_state(link: RoverLink) -> bytes:
    """Return the state of a link as bytes for the brain."""
    figures = link.heard.figures
    return json.dumps(
        {
            "phase": link.phase, "problem": link.problem, "setpoints": figures.setpoints,
            "reopened": figures.reopened, "losses": figures.losses, **link.counted(),
        }
    ).encode()  # fmt: skip


def packed_engagement(number: int) -> bytes:
    """Return the number of an engagement as bytes for the driver."""
    return ENGAGEMENT + _NUMBER.pack(number)
