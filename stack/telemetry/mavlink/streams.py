"""Which message is sent how often. Periods are wall seconds; stations change them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import all as mav

from stack.telemetry.mavlink import motion, status
from stack.telemetry.mavlink.geography import Geography
from stack.telemetry.mavlink.handover import Handover
from stack.telemetry.mavlink.texts import Send
from stack.telemetry.records import Snapshot

Make = Callable[[Snapshot, Geography], Any]
"""make(snapshot, geography): the message, or None if there is nothing to tell."""

STREAMS: dict[int, tuple[Make, float]] = {
    mav.MAVLINK_MSG_ID_ATTITUDE: (motion.attitude, 10.0),
    mav.MAVLINK_MSG_ID_ATTITUDE_QUATERNION: (motion.attitude_quaternion, 0.0),
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED: (motion.local_position, 10.0),
    mav.MAVLINK_MSG_ID_ODOMETRY: (motion.odometry, 5.0),
    mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: (motion.global_position, 5.0),
    mav.MAVLINK_MSG_ID_GPS_RAW_INT: (motion.gps_raw, 1.0),
    mav.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN: (motion.global_origin, 0.2),
    mav.MAVLINK_MSG_ID_HOME_POSITION: (motion.home_position, 0.5),
    mav.MAVLINK_MSG_ID_VFR_HUD: (motion.head_up_display, 4.0),
    mav.MAVLINK_MSG_ID_OBSTACLE_DISTANCE: (motion.obstacle_distance, 5.0),
    mav.MAVLINK_MSG_ID_SYS_STATUS: (status.system_status, 1.0),
    mav.MAVLINK_MSG_ID_BATTERY_STATUS: (status.battery_status, 0.5),
    mav.MAVLINK_MSG_ID_EXTENDED_SYS_STATE: (status.extended_state, 1.0),
    mav.MAVLINK_MSG_ID_SYSTEM_TIME: (status.system_time, 1.0),
}
"""Maker and rate in Hz, by number of the message; rate 0: sent only when a station asks."""

FASTEST, LONGEST_PERIOD = 50.0, 1000.0
"""Hz, and seconds: no message is sent more often, or more rarely."""

_POSITION = (
    mav.MAVLINK_MSG_ID_LOCAL_POSITION_NED, mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
    mav.MAVLINK_MSG_ID_ODOMETRY,
)  # fmt: skip
_STATUS = (
    mav.MAVLINK_MSG_ID_SYS_STATUS, mav.MAVLINK_MSG_ID_GPS_RAW_INT,
    mav.MAVLINK_MSG_ID_BATTERY_STATUS,
)  # fmt: skip
GROUPS: dict[int, tuple[int, ...]] = {
    mav.MAV_DATA_STREAM_EXTENDED_STATUS: _STATUS,
    mav.MAV_DATA_STREAM_POSITION: _POSITION,
    mav.MAV_DATA_STREAM_EXTRA1: (mav.MAVLINK_MSG_ID_ATTITUDE,),
    mav.MAV_DATA_STREAM_EXTRA2: (mav.MAVLINK_MSG_ID_VFR_HUD,),
    mav.MAV_DATA_STREAM_EXTRA3: (
        mav.MAVLINK_MSG_ID_OBSTACLE_DISTANCE, mav.MAVLINK_MSG_ID_SYSTEM_TIME,
    ),
}  # fmt: skip
"""Messages by group of the older REQUEST_DATA_STREAM; its 0 means all groups."""


class Streams:
    """Sends messages at their rates.

    Args:
        handover: with the newest snapshot.
        geography: origin and home.
        send: sends a message.
    """

    def __init__(self, handover: Handover, geography: Geography, send: Send) -> None:
        self._handover, self._geography, self._send = handover, geography, send
        self._periods = {number: _period(rate) for number, (_, rate) in STREAMS.items()}
        self._due = dict.fromkeys(STREAMS, 0.0)

    def interval(self, number: int) -> int:
        """Microseconds between two messages; -1: not sent; 0: there is no such message."""
        if number not in STREAMS:
            return 0
        period = self._periods[number]
        return -1 if period is None else round(period * 1e6)

    def set_interval(self, number: int, microseconds: float) -> bool:
        """Change a rate; return whether there is such a message.

        Args:
            number: of the message.
            microseconds: between two; -1 (or NaN) stops it, 0 is the default.
        """
        if number not in STREAMS:
            return False
        if microseconds == 0.0:
            self._periods[number] = _period(STREAMS[number][1])
        elif microseconds > 0.0:
            self._periods[number] = min(max(microseconds * 1e-6, 1.0 / FASTEST), LONGEST_PERIOD)
        else:
            self._periods[number] = None
        self._due[number] = 0.0
        return True

    def set_group(self, group: int, rate: float) -> None:
        """Change the rates of a group, Hz; 0 stops it. Unknown groups have no messages."""
        groups = GROUPS.values() if group == 0 else (GROUPS.get(group, ()),)
        for number in (number for members in groups for number in members):
            self.set_interval(number, 1e6 / rate if rate > 0.0 else -1.0)

    def message(self, number: int) -> Any:
        """The message of now; None if there is none, or nothing to tell."""
        snapshot = self._handover.snapshot
        if number not in STREAMS or snapshot is None:
            return None
        return STREAMS[number][0](snapshot, self._geography)

    def send_now(self, number: int) -> None:
        """Send a message, if there is anything to tell."""
        message = self.message(number)
        if message is not None:
            self._send(message)

    def tick(self, now: float) -> None:
        """Send what is due, wall seconds."""
        for number, period in self._periods.items():
            if period is None or now < self._due[number]:
                continue
            late = now - self._due[number] > period
            self._due[number] = now + period if late else self._due[number] + period
            self.send_now(number)


def _period(rate: float) -> float | None:
    return 1.0 / rate if rate > 0.0 else None
