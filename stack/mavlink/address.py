"""Addresses of MAVLink links, written as MAVProxy and MAVSDK do.

Examples: `udpout:192.168.1.5:14550`, `serial:/dev/ttyACM0:57600`.

`udpin` (also written `udp`) and `tcpin` listen; `udpout` and `tcp` call the other side.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from stack.errors import InputError

BAUD = 57600
FORM = (
    "expected udpin:HOST:PORT or tcpin:HOST:PORT (listen), udpout:HOST:PORT or tcp:HOST:PORT "
    "(call), or serial:DEVICE[:BAUD]"
)
LISTENING = ("udpin", "tcpin")
_LOOPBACK = ("127.0.0.1", "localhost")


@dataclass(frozen=True, slots=True)
class MavlinkAddress:
    """Address of a link.

    Attributes:
        kind: udpin and tcpin listen, udpout and tcp call, serial.
        place: host or device.
        number: port, or baud rate of a serial device.
    """

    kind: str
    place: str
    number: int

    @property
    def listens(self) -> bool:
        """Whether others connect to it."""
        return self.kind in LISTENING

    def __str__(self) -> str:
        return f"{self.kind}:{self.place}:{self.number}"


def read_address(text: str, *, signed: bool = False) -> MavlinkAddress:
    """Parse the address of a command line option or a file.

    Args:
        text: as `FORM` says.
        signed: whether every message must be signed; only then may the link listen to other
            machines.

    Raises:
        InputError: wrong syntax, a port out of range, or an address that would listen to other
            machines, where anyone could command or listen.
    """
    kind, _, rest = text.partition(":")
    if kind == "serial":
        match = re.fullmatch(r"(/dev/[^:]+)(?::(\d+))?", rest)
        if match is None or (match[2] is not None and int(match[2]) == 0):
            raise InputError(f"MAVLink address {text!r}: {FORM}")
        return MavlinkAddress(kind, match[1], int(match[2] or BAUD))
    kind = "udpin" if kind == "udp" else kind
    host, _, port = rest.rpartition(":")
    if kind not in ("udpin", "udpout", "tcpin", "tcp") or not re.fullmatch(r"[\w.-]+", host):
        raise InputError(f"MAVLink address {text!r}: {FORM}")
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(f"MAVLink address {text!r}: port {port!r} is not in 1..65535")
    if kind in LISTENING and host not in _LOOPBACK and not signed:
        raise InputError(
            f"MAVLink address {text!r} would listen on {host}, where anyone can connect; listen on "
            f"127.0.0.1, or call the other side with {'udpout' if kind == 'udpin' else 'tcp'}:"
            f"{host}:{port}"
        )
    return MavlinkAddress(kind, host, int(port))
