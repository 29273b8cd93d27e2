"""Sink that shows a run to MAVLink ground stations as a ground rover.

It sends only, and accepts no commands. It identifies as ArduPilot with ArduRover's mode numbers,
which MAVProxy, MAVSDK and QGroundControl understand. Rates are in robot time; only the heartbeat
uses the wall clock, because stations report a lost link after three wall seconds without one.
"""

from __future__ import annotations

import os
import re
import socket
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import cos, pi, sin
from time import monotonic  # noqa: TID251 - heartbeats belong to the transport
from typing import Any

from stack.errors import InputError
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot
from stack.types import LOST_HEALTH, Battery, wrap_angle

SYSTEM, COMPONENT = 1, 1
BAUD = 57600

HEARTBEAT_PERIOD = 1.0
"""Wall seconds; the other periods are seconds of robot time."""

STATUS_PERIOD = 1.0
MOTION_PERIOD = 0.1
BATTERY_PERIOD = 2.0

HOLD_MODE, AUTO_MODE, INITIALISING_MODE = 4, 10, 16
"""Mode numbers of ArduRover."""

TEXT_BYTES = 50
MAX_CHUNKS = 8
"""Largest number of chunks of one text; longer texts are truncated."""

SENT_KINDS = ("say",)
"""Kinds of events that are sent at every level; of others, only warnings and errors."""

_LOOPBACK = ("127.0.0.1", "localhost")
_FORM = "expected udpout:HOST:PORT, udp:HOST:PORT, tcp:HOST:PORT or serial:DEVICE[:BAUD]"
_HARDWARE = ("3D_GYRO", "3D_ACCEL", "BATTERY", "MOTOR_OUTPUTS")
_POSITION = ("LASER_POSITION", "VISION_POSITION")
"""MAVLink's sensor bits for a position from scan matching and markers; there is no GPS."""

LOW_CHARGE, CRITICAL_CHARGE = 0.2, 0.1
_UNKNOWN_TEMPERATURE, _UNKNOWN_CELL = 32767, 65535

MAX_READ = 50
"""Largest number of incoming messages read between two snapshots; they are ignored."""


@dataclass(frozen=True, slots=True)
class MavlinkAddress:
    """Address of a ground station.

    Attributes:
        kind: udpout (send to it), udp and tcp (listen for it, on this machine only), serial.
        place: host or device.
        number: port, or baud rate of a serial device.
    """

    kind: str
    place: str
    number: int

    @property
    def pymavlink(self) -> str:
        """The address in pymavlink's syntax."""
        if self.kind == "serial":
            return self.place
        prefix = {"udpout": "udpout", "udp": "udpin", "tcp": "tcpin"}[self.kind]
        return f"{prefix}:{self.place}:{self.number}"


def read_address(text: str) -> MavlinkAddress:
    """Parse the address of a command line option.

    Raises:
        InputError: wrong syntax, a port out of range, or an address that would listen to other
            machines, from which anyone could receive the data.
    """
    kind, _, rest = text.partition(":")
    if kind == "serial":
        match = re.fullmatch(r"(/dev/[^:]+)(?::(\d+))?", rest)
        if match is None:
            raise InputError(f"MAVLink address {text!r}: {_FORM}")
        return MavlinkAddress(kind, match[1], int(match[2] or BAUD))
    host, _, port = rest.rpartition(":")
    if kind not in ("udpout", "udp", "tcp") or not host or not re.fullmatch(r"[\w.-]+", host):
        raise InputError(f"MAVLink address {text!r}: {_FORM}")
    if not port.isdecimal() or not 0 < int(port) < 65536:
        raise InputError(f"MAVLink address {text!r}: port {port!r} is not in 1..65535")
    if kind in ("udp", "tcp") and host not in _LOOPBACK:
        raise InputError(
            f"MAVLink address {text!r} would listen on {host}, where anyone can connect; "
            f"listen on 127.0.0.1, or send to one station with udpout:{host}:{port}"
        )
    return MavlinkAddress(kind, host, int(port))


class MavlinkSink:
    """Sends mode, position, attitude, battery and texts of a run over MAVLink."""

    def __init__(self, address: str, clock: Callable[[], float] = monotonic) -> None:
        """Check the address; `open` opens the link.

        Args:
            address: udpout:HOST:PORT, udp:HOST:PORT, tcp:HOST:PORT or serial:DEVICE[:BAUD].
            clock: returns wall seconds.

        Raises:
            InputError: the address is wrong or not allowed.
        """
        self.address = read_address(address)
        self._clock = clock
        self._connection: Any = None
        self._dialect: Any = None
        self._due: dict[str, float] = {}
        self._state = MissionState.STARTING
        self._last_heartbeat = -HEARTBEAT_PERIOD
        self._texts = 0

    def open(self, info: RunInfo) -> None:
        """Open the link.

        Raises:
            OSError: the port is in use, the host is unknown or the device does not exist.
        """
        os.environ["MAVLINK20"] = "1"  # pymavlink reads it when it is imported
        from pymavlink import mavutil
        from pymavlink.dialects.v20 import ardupilotmega

        address = self.address
        if address.kind != "serial":
            # Resolve the name once; otherwise pymavlink would resolve it in every send.
            address = replace(address, place=socket.gethostbyname(address.place))
        self._dialect = ardupilotmega
        self._connection = mavutil.mavlink_connection(
            address.pymavlink,
            baud=address.number,
            source_system=SYSTEM,
            source_component=COMPONENT,
            dialect="ardupilotmega",
        )
        self._heartbeat()

    def event(self, event: Event) -> None:
        """Send warnings, errors and texts of the mission as STATUSTEXT."""
        severities = {
            "warning": self._dialect.MAV_SEVERITY_WARNING,
            "error": self._dialect.MAV_SEVERITY_ERROR,
        }
        if event.level in severities:
            self._send_text(severities[event.level], event.text)
        elif event.kind in SENT_KINDS:
            self._send_text(self._dialect.MAV_SEVERITY_INFO, event.text)

    def wants_snapshot(self, time: float) -> bool:
        """Whether MOTION_PERIOD has passed; also sends the heartbeat while robot time stops."""
        if self._clock() - self._last_heartbeat >= HEARTBEAT_PERIOD:
            self._heartbeat()
        return time >= self._due.get("motion", 0.0) - 1e-9

    def snapshot(self, snapshot: Snapshot) -> None:
        """Send the messages that are due."""
        self._read()
        time = snapshot.time
        if snapshot.state is not self._state:
            self._state = snapshot.state
            self._heartbeat()
        if self._is_due("motion", time, MOTION_PERIOD):
            self._motion(snapshot)
        if self._is_due("status", time, STATUS_PERIOD):
            self._status(snapshot)
        if self._is_due("battery", time, BATTERY_PERIOD):
            self._battery(snapshot.battery)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Close the link. Safe to call twice."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _is_due(self, what: str, time: float, period: float) -> bool:
        if time < self._due.get(what, 0.0) - 1e-9:
            return False
        while self._due.get(what, 0.0) <= time + 1e-9:
            self._due[what] = self._due.get(what, 0.0) + period
        return True

    def _read(self) -> None:
        """Read incoming messages, so that `udp` and `tcp` learn the station's address."""
        for _ in range(MAX_READ):
            if self._connection.recv_match(blocking=False) is None:
                return

    def _heartbeat(self) -> None:
        dialect, state = self._dialect, self._state
        mode, armed, status = {
            MissionState.STARTING: (INITIALISING_MODE, False, dialect.MAV_STATE_BOOT),
            MissionState.RUNNING: (AUTO_MODE, True, dialect.MAV_STATE_ACTIVE),
            MissionState.PAUSED: (HOLD_MODE, True, dialect.MAV_STATE_ACTIVE),
            MissionState.EMERGENCY_STOP: (HOLD_MODE, False, dialect.MAV_STATE_CRITICAL),
        }.get(state, (HOLD_MODE, False, dialect.MAV_STATE_STANDBY))
        flags = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if armed:
            flags |= dialect.MAV_MODE_FLAG_SAFETY_ARMED
        self._connection.mav.heartbeat_send(
            dialect.MAV_TYPE_GROUND_ROVER, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, flags, mode, status
        )
        self._last_heartbeat = self._clock()

    def _motion(self, snapshot: Snapshot) -> None:
        """Send attitude and position, converted from east-north-up to north-east-down."""
        milliseconds = round(snapshot.time * 1000.0) & 0xFFFFFFFF
        pose, velocity = snapshot.pose, snapshot.measured
        yaw = wrap_angle(pi / 2.0 - pose.heading)
        self._connection.mav.attitude_send(
            milliseconds, 0.0, 0.0, yaw, 0.0, 0.0, -velocity.angular
        )  # fmt: skip
        c, s = cos(pose.heading), sin(pose.heading)
        east = c * velocity.linear - s * velocity.lateral
        north = s * velocity.linear + c * velocity.lateral
        self._connection.mav.local_position_ned_send(
            milliseconds, pose.y, pose.x, 0.0, north, east, 0.0
        )

    def _status(self, snapshot: Snapshot) -> None:
        """Send sensors and battery; without the geofence bit MAVProxy reports a fence breach."""
        hardware = self._bits(_HARDWARE) | self._dialect.MAV_SYS_STATUS_GEOFENCE
        position = self._bits(_POSITION) | self._dialect.MAV_SYS_STATUS_PREARM_CHECK
        present = hardware | position
        healthy = present if snapshot.health >= LOST_HEALTH else hardware
        battery = snapshot.battery
        self._connection.mav.sys_status_send(
            present, present, healthy, 0, _millivolts(battery), -1, _percent(battery),
            0, 0, 0, 0, 0, 0,
        )  # fmt: skip

    def _battery(self, battery: Battery) -> None:
        dialect = self._dialect
        if battery.charging:
            state = dialect.MAV_BATTERY_CHARGE_STATE_CHARGING
        elif battery.charge < CRITICAL_CHARGE:
            state = dialect.MAV_BATTERY_CHARGE_STATE_CRITICAL
        elif battery.charge < LOW_CHARGE:
            state = dialect.MAV_BATTERY_CHARGE_STATE_LOW
        else:
            state = dialect.MAV_BATTERY_CHARGE_STATE_OK
        self._connection.mav.battery_status_send(
            0, dialect.MAV_BATTERY_FUNCTION_ALL, dialect.MAV_BATTERY_TYPE_UNKNOWN,
            _UNKNOWN_TEMPERATURE, [_millivolts(battery), *[_UNKNOWN_CELL] * 9], -1, -1, -1,
            _percent(battery), 0, state,
        )  # fmt: skip

    def _send_text(self, severity: int, text: str) -> None:
        chunks = list(text_chunks(text))
        number = 0
        if len(chunks) > 1:
            self._texts = number = self._texts % 65535 + 1
        for position, chunk in enumerate(chunks):
            self._connection.mav.statustext_send(severity, chunk, number, position)

    def _bits(self, names: tuple[str, ...]) -> int:
        bits = 0
        for name in names:
            bits |= getattr(self._dialect, f"MAV_SYS_STATUS_SENSOR_{name}")
        return bits


def text_chunks(text: str) -> Iterator[bytes]:
    """Split a text into chunks of at most TEXT_BYTES bytes of UTF-8, between characters.

    The last of several chunks is shorter by one byte, for the zero that marks it as the last.
    """
    words = " ".join(text.split())
    last = TEXT_BYTES
    for _ in range(MAX_CHUNKS - 1):
        encoded = words.encode("utf-8", "replace")
        if len(encoded) <= last:
            break
        piece = encoded[:TEXT_BYTES].decode("utf-8", "ignore")
        yield piece.encode()
        words, last = words[len(piece) :], TEXT_BYTES - 1
    yield words.encode("utf-8", "replace")[:last].decode("utf-8", "ignore").encode()


def _millivolts(battery: Battery) -> int:
    return min(max(round(battery.voltage * 1000.0), 0), 65534)


def _percent(battery: Battery) -> int:
    return min(max(round(battery.charge * 100.0), 0), 100)
