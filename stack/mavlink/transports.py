"""Bytes over UDP, TCP or a serial line, without blocking.

A sender never waits: what the system does not take at once is dropped (UDP) or kept up to
BACKLOG bytes (streams). Names are resolved once. Listening transports serve at most MAX_PEERS.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import socket
import stat
import termios
from abc import ABC, abstractmethod
from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass, field
from typing import Any

from stack.mavlink.address import MavlinkAddress
from stack.optional_packages import PYSERIAL

MAX_PEERS = 16
PEER_TIMEOUT = 10.0
"""Seconds of silence after which a UDP peer is forgotten, and gets nothing any more."""

BACKLOG = 1 << 16
"""Bytes that a stream keeps for a peer that does not read; then it is disconnected."""

BLOCK = 2048
"""Bytes: the rest of a longer datagram is dropped. A frame has at most 280, and 13 of signature."""

MAX_BLOCKS, MAX_BYTES = 64, 1 << 14
"""That one `receive` reads of one peer, so that a flood cannot hold the caller: the largest number
of blocks, and the bytes after which it stops."""

CONNECT_TIMEOUT = 0.25
"""Seconds for which opening a TCP connection may hold the caller."""

Peer = Hashable
"""Identifies the other end to `send`."""


class Transport(ABC):
    """Moves bytes. Not thread-safe but for `send`.

    Attributes:
        is_stream: whether a message may be spread over blocks; else a block is a datagram.
    """

    is_stream = True

    @abstractmethod
    def receive(self, timeout: float) -> list[tuple[Peer, bytes]]:
        """Wait at most `timeout` seconds for bytes.

        Raises:
            OSError: the connection or device is gone.
        """

    @abstractmethod
    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        """Send to a peer, or to all; whether somebody is there and took it all.

        Raises:
            OSError: the connection or device is gone.
        """

    @abstractmethod
    def close(self) -> None:
        """Close. Safe to call twice."""


def open_transport(address: MavlinkAddress, clock: Callable[[], float]) -> Transport:
    """Open a transport.

    Raises:
        OSError: the port is in use, the host is unknown or does not answer, or the device does not
            exist.
        InputError: pyserial is not installed.
    """
    if address.kind == "serial":
        return SerialTransport(address.place, address.number)
    place = (socket.gethostbyname(address.place), address.number)
    if address.kind in ("udpin", "udpout"):
        return UdpTransport(place, address.kind == "udpin", clock)
    if address.kind == "tcpin":
        return TcpServer(place)
    return TcpClient(place)


class UdpTransport(Transport):
    """UDP: sends to one place, or to those who have written within PEER_TIMEOUT."""

    is_stream = False

    def __init__(self, place: tuple[str, int], listens: bool, clock: Callable[[], float]) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._clock = clock
        self._place = None if listens else place
        self._heard: dict[Peer, float] = {}
        try:
            if listens:
                self._socket.bind(place)
        except OSError:
            self._socket.close()
            raise

    def receive(self, timeout: float) -> list[tuple[Peer, bytes]]:
        """Wait for datagrams; a calling transport takes only those of the host it calls."""
        if not _readable(self._socket, timeout):
            return []
        found: list[tuple[Peer, bytes]] = []
        read = 0
        for _ in range(MAX_BLOCKS):
            if read >= MAX_BYTES:
                break
            try:
                data, place = self._socket.recvfrom(BLOCK)
            except BlockingIOError:
                break
            except ConnectionError:  # nobody listened to what was sent before
                continue
            read += len(data)
            if self._place is not None:
                if place[0] == self._place[0]:
                    found.append((self._place, data))
            elif self._admitted(place):
                found.append((place, data))
        return found

    def _admitted(self, place: Peer) -> bool:
        now = self._clock()
        if place not in self._heard and len(self._heard) >= MAX_PEERS:
            self._forget_silent(now)
            if len(self._heard) >= MAX_PEERS:
                return False
        self._heard[place] = now
        return True

    def _forget_silent(self, now: float) -> None:
        self._heard = {
            peer: heard for peer, heard in self._heard.items() if now - heard <= PEER_TIMEOUT
        }

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        """Send a datagram to a peer, or to all."""
        if self._place is not None:
            places: list[Any] = [self._place]
        elif peer is not None:
            places = [peer]
        else:
            now = self._clock()
            places = [p for p, heard in [*self._heard.items()] if now - heard <= PEER_TIMEOUT]
        sent = bool(places)
        for place in places:
            try:
                self._socket.sendto(data, place)
            except (BlockingIOError, ConnectionError):
                sent = False
            except OSError as error:
                if error.errno not in (errno.ENETUNREACH, errno.EHOSTUNREACH, errno.ENOBUFS):
                    raise
                sent = False
        return sent

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


@dataclass
class _Stream:
    """A connected socket and what it has not taken yet."""

    socket: socket.socket
    waiting: bytearray = field(default_factory=bytearray)

    def read(self) -> Iterator[bytes]:
        """Yield what has come; an empty block at the end of the connection."""
        for _ in range(MAX_BYTES // BLOCK):
            try:
                data = self.socket.recv(BLOCK)
            except BlockingIOError:
                return
            except OSError:
                data = b""
            yield data
            if not data:
                return

    def write(self, data: bytes = b"") -> bool:
        """Send; whether the connection stands and its peer reads."""
        self.waiting += data
        try:
            while self.waiting:
                del self.waiting[: self.socket.send(self.waiting)]
        except BlockingIOError:
            pass
        except OSError:
            return False
        return len(self.waiting) <= BACKLOG


class TcpServer(Transport):
    """Listens for TCP connections."""

    def __init__(self, place: tuple[str, int]) -> None:
        self._streams: dict[Peer, _Stream] = {}
        self._listener = socket.create_server(place, backlog=MAX_PEERS)
        self._listener.setblocking(False)

    def receive(self, timeout: float) -> list[tuple[Peer, bytes]]:
        """Wait for bytes of any peer; accept new ones."""
        streams = dict(self._streams)
        sockets = [self._listener, *(stream.socket for stream in streams.values())]
        if not _readable_of(sockets, timeout):
            return []
        self._accept()
        found: list[tuple[Peer, bytes]] = []
        for peer, stream in streams.items():
            for data in stream.read():
                if data:
                    found.append((peer, data))
                else:
                    self._drop(peer)
        return found

    def _accept(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                connected, place = self._listener.accept()
                if len(self._streams) >= MAX_PEERS:
                    connected.close()
                    continue
                connected.setblocking(False)
                self._streams[place] = _Stream(connected)

    def _drop(self, peer: Peer) -> None:
        stream = self._streams.pop(peer, None)
        if stream is not None:
            stream.socket.close()

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        """Send to a peer, or to all; those who do not read are disconnected."""
        streams = dict(self._streams)
        chosen = streams if peer is None else {peer: streams[peer]} if peer in streams else {}
        taken = [name for name, stream in chosen.items() if stream.write(data)]
        for name in chosen.keys() - set(taken):
            with contextlib.suppress(OSError):  # `receive` drops it
                streams[name].socket.shutdown(socket.SHUT_RDWR)
        return bool(chosen) and len(taken) == len(chosen)

    def close(self) -> None:
        """Close all connections."""
        self._listener.close()
        for peer in [*self._streams]:
            self._drop(peer)


class TcpClient(Transport):
    """Calls a TCP server."""

    def __init__(self, place: tuple[str, int]) -> None:
        self._place = place
        connected = socket.create_connection(place, CONNECT_TIMEOUT)
        connected.setblocking(False)
        self._stream = _Stream(connected)

    def receive(self, timeout: float) -> list[tuple[Peer, bytes]]:
        """Wait for bytes."""
        if not _readable(self._stream.socket, timeout):
            return []
        blocks = [*self._stream.read()]
        if blocks and not blocks[-1]:
            raise ConnectionResetError(errno.ECONNRESET, "the other side has closed the connection")
        return [(self._place, data) for data in blocks]

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        """Send."""
        if not self._stream.write(data):
            raise ConnectionResetError(errno.ECONNRESET, "the other side does not read any more")
        return True

    def close(self) -> None:
        """Close the connection."""
        self._stream.socket.close()


class SerialTransport(Transport):
    """A serial device."""

    def __init__(self, device: str, baud: int) -> None:
        PYSERIAL.require(f"the serial device {device} needs")
        import serial

        # Anything else than a device, e.g. a file, would be read and written as one.
        if not stat.S_ISCHR(os.stat(device).st_mode):
            raise OSError(errno.ENODEV, f"{device} is not a serial device")
        try:
            self._port: Any = serial.Serial(device, baud, timeout=0, write_timeout=0)
        except serial.SerialException as error:
            raise OSError(error.errno or errno.EIO, str(error)) from None
        self._device = device
        self._waiting = bytearray()

    def receive(self, timeout: float) -> list[tuple[Peer, bytes]]:
        """Wait for bytes."""
        if not _readable(self._port, timeout):
            return []
        try:
            data = os.read(self._port.fileno(), BLOCK)
        except BlockingIOError:
            return []
        if not data:
            raise OSError(errno.ENODEV, f"{self._device} does not respond any more")
        return [(self._device, data)]

    def send(self, data: bytes, peer: Peer | None = None) -> bool:
        """Send; what a slow line does not take within BACKLOG bytes is dropped."""
        if len(self._waiting) > BACKLOG:
            return False
        self._waiting += data
        try:
            while self._waiting:
                del self._waiting[: os.write(self._port.fileno(), self._waiting)]
        except BlockingIOError:
            pass
        return True

    def close(self) -> None:
        """Close the device; what it has not sent is dropped, because a stuck line would block."""
        if self._port.is_open:
            with contextlib.suppress(OSError, termios.error):
                self._port.reset_output_buffer()
            self._port.close()


def _readable(source: Any, timeout: float) -> bool:
    return _readable_of([source], timeout)


def _readable_of(sources: list[Any], timeout: float) -> bool:
    """Whether one of them has bytes within the timeout; unlike select(), for any file number."""
    poll = select.poll()
    for source in sources:
        poll.register(source, select.POLLIN)
    return bool(poll.poll(max(0.0, timeout) * 1000.0))
