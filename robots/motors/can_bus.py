"""A CAN bus by python-can, which is imported only when a bus is opened."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from robots.motors.can_simple import Message, decode, encode, identifier
from stack.errors import BodyError, ParameterError
from stack.optional_packages import PYTHON_CAN

if TYPE_CHECKING:
    import can

MOST_FRAMES = 20
"""Frames that one call reads: more than a bus of 1 Mbit/s carries in 2 ms."""

BUS_OFF = 0x40
"""Bit of the identifier of Linux' error frames (linux/can/error.h)."""

UNSENT = 0.1
"""Seconds without a frame that could be sent after which the bus does not work."""


@dataclass(frozen=True)
class BusAddress:
    """Which bus.

    Attributes:
        interface: of python-can.
        channel: of the interface; ADDRESS:PORT for `udp_multicast`.
        bitrate: bits per second; 0: as it is set.
    """

    interface: str
    channel: str
    bitrate: int = 0

    def arguments(self) -> dict[str, Any]:
        """Return the arguments of `can.Bus`.

        Raises:
            ParameterError: the channel is not of this form.
        """
        found: dict[str, Any] = {"interface": self.interface, "channel": self.channel}
        if self.interface == "udp_multicast":
            address, _, port = self.channel.rpartition(":")
            if not address or not port.isdecimal():
                raise ParameterError("channel", f"expected ADDRESS:PORT, got {self.channel!r}")
            found |= {"channel": address.strip("[]"), "port": int(port), "fd": False}
            found["hop_limit"] = 0  # frames stay on this machine
        if self.bitrate:
            found["bitrate"] = self.bitrate
        return found

    def __str__(self) -> str:
        return f"{self.interface} {self.channel}"


class CanBus:
    """Frames to and from the axes of motor drives.

    Args:
        address: of the bus.
        nodes: whose frames are of interest.

    Attributes:
        ignored: frames so far that are not of these nodes or make no sense.
        unread: errors of the interface while it read.
        is_off: whether the controller has left the bus, also if it is back.

    Raises:
        InputError: python-can is not installed.
        BodyError: there is no such bus.
    """

    def __init__(self, address: BusAddress, nodes: tuple[int, ...]) -> None:
        PYTHON_CAN.require("a CAN bus needs")
        import can

        self._nodes, self._message = frozenset(nodes), can.Message
        self.ignored = self.unread = 0
        self.is_off, self._refused_since, self._refusal = False, None, ""
        try:
            self._bus: can.BusABC = can.Bus(**self._arguments(address))
        except Exception as error:  # interfaces raise what they like
            raise BodyError(f"{address}: {_words(error)}; {_remedy(address)}") from None

    _refused_since: float | None

    def _arguments(self, address: BusAddress) -> dict[str, Any]:
        found = address.arguments()
        if address.interface == "socketcan":  # the kernel filters; error frames come all the same
            found["can_filters"] = [
                {"can_id": node << 5, "can_mask": 0x7E0, "extended": False} for node in self._nodes
            ]
        return found

    def send(self, node: int, message: Message, now: float) -> None:
        """Send a message if the interface takes it; does not wait."""
        self._send(identifier(node, type(message)), encode(message), now)

    def request(self, node: int, kind: type[Message], now: float) -> None:
        """Ask a node for a message, by a remote frame."""
        self._send(identifier(node, kind), b"", now, kind.LAYOUT.size)

    def receive(self, timeout: float = 0.0) -> list[tuple[int, Message]]:
        """Return at most MOST_FRAMES messages, each with its node.

        Args:
            timeout: seconds to wait for the first.
        """
        found: list[tuple[int, Message]] = []
        for _ in range(MOST_FRAMES):
            try:
                frame = self._bus.recv(timeout)
            except Exception:  # interfaces raise what they like on a frame that makes no sense
                self.unread += 1
                continue
            if frame is None:
                break
            timeout = 0.0
            message = self._read(frame)
            if message is None:
                self.ignored += 1
            else:
                found.append(message)
        return found

    def problem(self, now: float) -> str:
        """Why the bus does not work; empty if it does."""
        if self.is_off:
            return "the CAN controller is bus-off: look for a short circuit or a wrong bit rate"
        if self._refused_since is not None and now - self._refused_since > UNSENT:
            return f"nothing can be sent on the CAN bus: {self._refusal}"
        return ""

    def forget(self) -> None:
        """Forget all problems."""
        self.is_off, self._refused_since = False, None

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()

    def _send(self, number: int, content: bytes, now: float, remote: int = 0) -> None:
        frame = self._message(
            arbitration_id=number, is_extended_id=False, data=None if remote else content,
            is_remote_frame=remote > 0, dlc=remote or None,
        )  # fmt: skip
        try:
            self._bus.send(frame, timeout=0.0)
        except Exception as error:  # as above; the buffer may only be full for a moment
            if self._refused_since is None:
                self._refused_since = now
            self._refusal = _words(error)
        else:
            self._refused_since = None

    def _read(self, frame: can.Message) -> tuple[int, Message] | None:
        if frame.is_error_frame:
            self.is_off = self.is_off or bool(frame.arbitration_id & BUS_OFF)
            return None
        if frame.is_extended_id or frame.is_remote_frame or frame.is_fd:
            return None
        read = decode(frame.arbitration_id, bytes(frame.data))
        return read if read is not None and read[0] in self._nodes else None


def _words(error: BaseException) -> str:
    """Return the deepest reason of an error: the system's own words."""
    while error.__cause__ is not None:
        error = error.__cause__
    return str(getattr(error, "strerror", None) or error or type(error).__name__)


def _remedy(address: BusAddress) -> str:
    if address.interface == "socketcan":
        name = address.channel
        return f"set it up: sudo ip link set {name} up type can bitrate 500000 restart-ms 100"
    return "see the interfaces of python-can"
