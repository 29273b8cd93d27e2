"""One MAVLink 2 connection: one reader that gets every message with the time of its arrival.

    link = Link(read_address("udpout:127.0.0.1:14550"), system=245, component=191)
    link.send(link.dialect.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3))
    for received in link.receive(timeout=0.1):
        print(received.kind, received.system, received.message)

pymavlink is used for frames only, not for connections: its own ones send to everybody who ever
wrote, guess the target from heartbeats, and drop what was not asked for.
"""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Callable
from dataclasses import dataclass, field
from threading import Lock
from time import monotonic  # noqa: TID251 - arrival times belong to the transport
from typing import Any

from stack.mavlink.address import MavlinkAddress
from stack.mavlink.transports import Peer, Transport, open_transport

MakeCodec = Callable[[int, int], Any]
"""make_codec(system, component): a `MAVLink` of the dialect, which packs and parses frames."""

BEGINS = (b"\xfd", b"\xfe")
"""First bytes of frames of MAVLink 2 and 1; a datagram begins with a frame."""

MAX_SOURCES = 64
"""Systems and components whose sequence numbers are followed."""


@dataclass(frozen=True, slots=True)
class Received:
    """A message with its origin.

    Attributes:
        message: of pymavlink.
        at: when its bytes were read, seconds of the link's clock.
        peer: the other end, for `Link.send`.
    """

    message: Any
    at: float
    peer: Peer = None

    @property
    def kind(self) -> str:
        """Name of the message: HEARTBEAT."""
        return str(self.message.get_type())

    @property
    def system(self) -> int:
        """Id of the sending system."""
        return int(self.message.get_srcSystem())

    @property
    def component(self) -> int:
        """Id of the sending component."""
        return int(self.message.get_srcComponent())


@dataclass
class Counters:
    """What has passed a link.

    Attributes:
        received: messages.
        refused: frames that are damaged, unknown, or whose signature is wrong.
        missed: messages that were sent but have not come, by the gaps of sequence numbers.
        sent: messages.
        unsent: messages that nobody took.
    """

    received: int = 0
    refused: int = 0
    missed: int = 0
    sent: int = 0
    unsent: int = 0


@dataclass
class _Sequences:
    """Next sequence number of each source."""

    following: dict[tuple[int, int], int] = field(default_factory=dict)

    def gap(self, message: Any) -> int:
        """Messages missing before this one."""
        source = (message.get_srcSystem(), message.get_srcComponent())
        number = message.get_seq()
        expected = self.following.get(source)
        if expected is None and len(self.following) >= MAX_SOURCES:
            return 0
        self.following[source] = (number + 1) % 256
        return 0 if expected is None else (number - expected) % 256


class Link:
    """A connection that one thread reads; any thread may send.

    Args:
        address: of the other side, or where to listen.
        system: our id.
        component: our id.
        make_codec: for signed links; else plain frames.
        clock: returns seconds.

    Attributes:
        dialect: pymavlink's module with messages (`MAVLink_heartbeat_message`) and constants.
        counters: what has passed.

    Raises:
        OSError: the port is in use, the host is unknown or does not answer, or the device does not
            exist. `opening_problem` says it for people.
        InputError: a library is missing.
    """

    def __init__(
        self, address: MavlinkAddress, *, system: int, component: int,
        make_codec: MakeCodec | None = None, clock: Callable[[], float] = monotonic,
    ) -> None:  # fmt: skip
        from pymavlink.dialects.v20 import all as dialect

        self.address, self.system, self.component = address, system, component
        self.dialect: Any = dialect
        self.counters = Counters()
        self._clock = clock
        self._make_codec = make_codec or (lambda s, c: dialect.MAVLink(None, s, c))
        self._packing = self._codec()
        self._parsing: dict[Peer, Any] = {}
        self._sequences = _Sequences()
        self._lock = Lock()
        self._closed = False
        self._transport: Transport = open_transport(address, clock)

    def _codec(self) -> Any:
        codec = self._make_codec(self.system, self.component)
        codec.robust_parsing = True  # damaged frames become BAD_DATA, not exceptions
        return codec

    def send(self, message: Any, to: Peer | None = None) -> bool:
        """Send a message to a peer, or to all that are there; from any thread, without waiting.

        Returns:
            Whether somebody was there to take it.

        Raises:
            OSError: the connection or device is gone.
        """
        with self._lock:
            if self._closed:
                return False
            codec = self._packing
            frame = message.pack(codec)
            codec.seq = (codec.seq + 1) % 256
            taken = self._transport.send(bytes(frame), to)
            self.counters.sent += taken
            self.counters.unsent += not taken
        return taken

    def receive(self, timeout: float = 0.0) -> list[Received]:
        """Return what has come; wait at most `timeout` seconds for the first message.

        Raises:
            OSError: the connection or device is gone.
        """
        blocks = self._transport.receive(timeout)
        now = self._clock()
        return [
            Received(message, now, peer)
            for peer, data in blocks
            for message in self._parsed(peer, data)
        ]

    def _parsed(self, peer: Peer, data: bytes) -> list[Any]:
        stream = self._transport.is_stream
        if not stream and data[:1] not in BEGINS:  # noise is not worth parsing
            self.counters.refused += 1
            return []
        key = peer if stream else None
        codec = self._parsing.get(key)
        if codec is None:
            if len(self._parsing) >= MAX_SOURCES:
                self._parsing.clear()  # peers come and go; their halves of frames are lost
            codec = self._parsing[key] = self._codec()
        found = codec.parse_buffer(data) or []
        if not stream:
            # A frame does not go beyond its datagram; a half one must not swallow the next.
            codec.buf, codec.buf_index = bytearray(), 0
        messages = []
        for message in found:
            kind = message.get_type()
            if kind == "BAD_DATA" or kind.startswith("UNKNOWN_"):
                self.counters.refused += 1
                continue
            self.counters.received += 1
            self.counters.missed += self._sequences.gap(message)
            messages.append(message)
        return messages

    def close(self) -> None:
        """Close the connection. Safe to call twice."""
        with self._lock:
            if not self._closed:
                self._closed = True
                with contextlib.suppress(OSError):
                    self._transport.close()


def opening_problem(address: MavlinkAddress, error: OSError) -> str:
    """Why a link cannot be opened: what, where and what to do."""
    problem = error.strerror or str(error)
    hints = {
        errno.EADDRINUSE: "another program listens there; end it or choose another port",
        errno.ECONNREFUSED: "nothing listens there: is the robot or its router running?",
        errno.EACCES: "your user may not open it: add yourself to the group dialout",
        errno.ENOENT: "is the cable plugged in?",
    }
    hint = hints.get(error.errno or 0)
    return f"MAVLink address {address}: {problem}" + (f"; {hint}" if hint else "")
