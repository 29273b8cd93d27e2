"""Sink that shows a run to MAVLink ground stations as a ground rover.

It accepts no commands, missions or parameters, and answers that they are not supported: a station
without an answer repeats itself and shows a time-out. It identifies as ArduPilot with
ArduRover's mode numbers, which MAVProxy, MAVSDK and QGroundControl understand. Rates are in robot
time; only the heartbeat and the answers use the wall clock: stations report a lost link after three
wall seconds without a heartbeat, and expect an answer in half a second.
"""

from __future__ import annotations

import errno
import os
import socket
import stat
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import cos, pi, sin
from time import monotonic  # noqa: TID251 - heartbeats belong to the transport
from typing import Any

from stack.errors import InputError
from stack.mavlink.address import MavlinkAddress, read_address
from stack.optional_packages import PYSERIAL
from stack.schedule import Schedule
from stack.telemetry.records import Event, MissionState, RunInfo, Snapshot
from stack.types import Battery, wrap_angle

SYSTEM, COMPONENT = 1, 1

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

_HARDWARE = ("3D_GYRO", "3D_ACCEL", "BATTERY", "MOTOR_OUTPUTS")
_POSITION = ("LASER_POSITION", "VISION_POSITION")
"""MAVLink's sensor bits for a position from scan matching and markers; there is no GPS."""

LOW_CHARGE, CRITICAL_CHARGE = 0.2, 0.1
_UNKNOWN_TEMPERATURE, _UNKNOWN_CELL = 32767, 65535

MAX_READ = 50
"""Largest number of incoming messages read at once."""

READ_PERIOD = 0.1
"""Wall seconds between two looks for incoming messages."""

MISSION_REQUESTS = frozenset(
    {
        "MISSION_COUNT", "MISSION_ITEM", "MISSION_ITEM_INT", "MISSION_REQUEST_LIST",
        "MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_CLEAR_ALL", "MISSION_SET_CURRENT",
        "MISSION_WRITE_PARTIAL_LIST", "MISSION_REQUEST_PARTIAL_LIST",
    }
)  # fmt: skip
PARAMETER_REQUESTS = frozenset({"PARAM_SET", "PARAM_REQUEST_READ", "PARAM_REQUEST_LIST"})
NOT_SUPPORTED = "this vehicle accepts no commands, missions or parameters over MAVLink"


class MavlinkSink:
    """Sends mode, position, attitude, battery and texts of a run over MAVLink.

    Attributes:
        address: of the ground station.
    """

    link = "MAVLink"

    def __init__(self, address: str, clock: Callable[[], float] = monotonic) -> None:
        """Open the link; nothing is sent before `open`.

        Args:
            address: as stack.mavlink.address reads it.
            clock: returns wall seconds.

        Raises:
            InputError: the address is wrong or not allowed, its port is in use, its host is
                unknown, its device does not exist, or a library is missing.
        """
        self.address = read_address(address)
        if self.address.kind == "serial":
            PYSERIAL.require(f"the MAVLink address {address!r} needs")
        self._clock = clock
        self._dialect: Any = None
        try:
            self._connection: Any = self._connected()
        except OSError as error:
            problem = error.strerror or str(error)
            raise InputError(f"MAVLink address {address!r} cannot be opened: {problem}") from None
        self._last_read = -READ_PERIOD
        self._told = False
        self._motions = Schedule(MOTION_PERIOD)
        self._statuses, self._batteries = Schedule(STATUS_PERIOD), Schedule(BATTERY_PERIOD)
        self._state = MissionState.STARTING
        self._last_heartbeat = -HEARTBEAT_PERIOD
        self._texts = 0

    def open(self, info: RunInfo) -> None:
        """Send the first heartbeat."""
        self._heartbeat()

    def _connected(self) -> Any:
        """A connection of pymavlink.

        Raises:
            OSError: the port is in use, the host is unknown or the device does not exist.
        """
        os.environ["MAVLINK20"] = "1"  # pymavlink reads it when it is imported
        from pymavlink import mavutil
        from pymavlink.dialects.v20 import ardupilotmega

        address = self.address
        if address.kind == "serial":
            # pymavlink would replay an ordinary file, and execute one in a folder called bin.
            if not stat.S_ISCHR(os.stat(address.place).st_mode):
                raise OSError(errno.ENODEV, f"{address.place} is not a serial device")
        else:
            # Resolve the name once; otherwise pymavlink would resolve it in every send.
            address = replace(address, place=socket.gethostbyname(address.place))
            _check_free(address)
        self._dialect = ardupilotmega
        name = address.place if address.kind == "serial" else str(address)
        return mavutil.mavlink_connection(
            name,
            baud=address.number,
            source_system=SYSTEM,
            source_component=COMPONENT,
            dialect="ardupilotmega",
        )

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
        """Whether MOTION_PERIOD has passed.

        Heartbeat and answers are sent here, because they go on while robot time stops.
        """
        now = self._clock()
        if now - self._last_heartbeat >= HEARTBEAT_PERIOD:
            self._heartbeat()
        if now - self._last_read >= READ_PERIOD:
            self._last_read = now
            self._read()
        return self._motions.is_due(time)

    def snapshot(self, snapshot: Snapshot) -> None:
        """Send the messages that are due."""
        time = snapshot.time
        if snapshot.state is not self._state:
            self._state = snapshot.state
            self._heartbeat()
        if self._motions.take(time):
            self._motion(snapshot)
        if self._statuses.take(time):
            self._status(snapshot)
        if self._batteries.take(time):
            self._battery(snapshot.battery)

    def close(self, report: Mapping[str, Any] | None) -> None:
        """Close the link. Safe to call twice."""
        if self._connection is not None:
            self._connection.close()
            self._connection = None

    def _read(self) -> None:
        """Read and answer incoming messages; `udpin` and `tcpin` learn the station's address by it.

        Raises:
            OSError: the serial device is gone.
        """
        if self._connection.portdead:
            raise OSError(errno.ENODEV, f"{self.address.place} does not respond any more")
        for _ in range(MAX_READ):
            message = self._connection.recv_match(blocking=False)
            if message is None:
                return
            kind = message.get_type()
            if kind != "BAD_DATA" and _is_for_us(message):
                self._answer(kind, message)

    def _answer(self, kind: str, message: Any) -> None:
        """Answer a request of a station: it is not supported."""
        dialect, send = self._dialect, self._connection.mav
        station = message.get_srcSystem(), message.get_srcComponent()
        if kind in ("COMMAND_LONG", "COMMAND_INT", "SET_MODE"):
            # ArduPilot acknowledges SET_MODE under the number of the message.
            number = message.get_msgId() if kind == "SET_MODE" else message.command
            send.command_ack_send(number, dialect.MAV_RESULT_UNSUPPORTED, 0, 0, *station)
        elif kind in MISSION_REQUESTS:
            plan = message.to_dict().get("mission_type", 0)  # not in all of them
            send.mission_ack_send(*station, dialect.MAV_MISSION_UNSUPPORTED, plan)
        elif kind not in PARAMETER_REQUESTS:  # for these MAVLink has no negative answer
            return
        if not self._told:
            self._told = True
            self._send_text(dialect.MAV_SEVERITY_WARNING, NOT_SUPPORTED)

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
        lost = snapshot.health < snapshot.health_thresholds.lost
        healthy = hardware if lost else present
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
        return sum(getattr(self._dialect, f"MAV_SYS_STATUS_SENSOR_{name}") for name in names)


def _check_free(address: MavlinkAddress) -> None:
    """Raise OSError if another program listens on the port; pymavlink would share it."""
    kinds = {"udpin": socket.SOCK_DGRAM, "tcpin": socket.SOCK_STREAM}
    if address.kind in kinds:
        with socket.socket(socket.AF_INET, kinds[address.kind]) as probe:
            if address.kind == "tcpin":  # a connection that was closed a moment ago is no reason
                probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind((address.place, address.number))


def _is_for_us(message: Any) -> bool:
    """Whether a message is addressed to this system, or to all."""
    fields = message.to_dict()
    system, component = fields.get("target_system"), fields.get("target_component", 0)
    return system in (0, SYSTEM) and component in (0, COMPONENT)


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
