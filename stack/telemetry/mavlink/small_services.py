"""Services that need nothing of the run: clocks, pings, and the refusal of file transfer."""

from __future__ import annotations

from struct import pack_into, unpack_from
from typing import Any

from pymavlink.dialects.v20 import all as mav

FTP_BYTES = 251
FTP_NAK, UNKNOWN_COMMAND = 129, 7


def timesync_answer(message: Any, now: float) -> Any:
    """The answer to a TIMESYNC request, wall seconds; None if it is an answer itself."""
    if message.tc1 != 0:
        return None
    return mav.MAVLink_timesync_message(round(now * 1e9), message.ts1)


def ping_answer(message: Any) -> Any:
    """The answer to a PING request; None if it is an answer itself."""
    if message.target_system != 0 or message.target_component != 0:
        return None
    sender = message.get_srcSystem(), message.get_srcComponent()
    return mav.MAVLink_ping_message(message.time_usec, message.seq, *sender)


def ftp_refusal(message: Any) -> Any:
    """The negative answer to a FILE_TRANSFER_PROTOCOL request: there is no file service."""
    asked = bytes(value & 0xFF for value in message.payload)[:FTP_BYTES].ljust(FTP_BYTES, b"\0")
    sequence, session, operation = unpack_from("<HBB", asked)
    payload = bytearray(FTP_BYTES)
    pack_into("<HBBBB", payload, 0, (sequence + 1) & 0xFFFF, session, FTP_NAK, 1, operation)
    payload[12] = UNKNOWN_COMMAND
    sender = message.get_srcSystem(), message.get_srcComponent()
    return mav.MAVLink_file_transfer_protocol_message(0, *sender, payload)
