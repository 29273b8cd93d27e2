"""Slamtec RPLIDAR of the A series (A1, A2, A3) on a serial port, in its standard scan mode.

After the manufacturer's "Interface Protocol and Application Notes": a request is 0xA5 and a
command; the answer begins with 0xA5 0x5A, its length and type. A scan is a stream of five bytes for
each measurement: quality with a start bit, angle in 1/64 degree clockwise, distance in 1/4 mm.
"""

from __future__ import annotations

import contextlib
import os
import select
from dataclasses import dataclass
from math import inf, nan, pi, radians
from typing import Any

import numpy as np

from robots.sensor_drivers.kinds import SensorDriver
from stack.errors import BodyError
from stack.optional_packages import PYSERIAL
from stack.parameters import REQUIRED, parameter
from stack.types import Pose2D, Scan

SYNC, STOP, SCAN, HEALTH, MOTOR = 0xA5, 0x25, 0x20, 0x52, 0xF0
FULL_SPEED = 660
"""Duty cycle that the A2 and A3 take as their usual 10 Hz; the A1 ignores it."""

SCAN_ANSWER = bytes([0xA5, 0x5A, 0x05, 0x00, 0x00, 0x40, 0x81])
HEALTH_ANSWER = bytes([0xA5, 0x5A, 0x03, 0x00, 0x00, 0x00, 0x06])
SAMPLE = 5
ANSWER_WITHIN, WAIT = 2.0, 1.0
"""Seconds."""

MOST_SAMPLES = 8192
"""Of a turn; more are not a scan but a fault."""


@dataclass(frozen=True)
class RplidarParameters:
    """Where the lidar is."""

    device: str = parameter(REQUIRED, public=True, help="serial device, such as /dev/ttyUSB0")
    baud: int = parameter(
        115200, at_least=9600, at_most=1_000_000, public=True,
        help="baud rate: 115200 for A1 and A2M8, 256000 for A2M12 and A3",
    )  # fmt: skip


class RplidarDriver(SensorDriver):
    """Reads turns of the lidar."""

    Parameters = RplidarParameters
    _port: Any = None
    _began: float | None

    def open(self) -> None:
        """Start the motor and the scan.

        Raises:
            BodyError: the lidar does not answer, or reports a fault.
        """
        PYSERIAL.require("an RPLIDAR needs")
        import serial

        p: RplidarParameters = self.parameters
        try:
            self._port = serial.Serial(p.device, p.baud, timeout=0, write_timeout=1.0)
            self._turn_motor(True)
        except (serial.SerialException, OSError) as error:
            problem = os.strerror(error.errno) if error.errno else str(error)
            raise BodyError(f"{p.device}: {problem}") from None
        self._buffer = bytearray()
        self._samples: list[tuple[float, float]] = []
        self._angle, self._began = 0.0, None
        self._request(STOP)
        self._until_quiet()
        self._request(HEALTH)
        status = self._answer(HEALTH_ANSWER, 3)
        if status[0] == 2:
            code = status[1] | status[2] << 8
            raise BodyError(f"{p.device}: the lidar reports error {code}; switch it off and on")
        self._request(MOTOR, FULL_SPEED.to_bytes(2, "little"))
        self._request(SCAN)
        self._answer(SCAN_ANSWER, 0)

    def read(self) -> Scan | None:
        """Wait for a complete turn."""
        until = self.clock() + WAIT
        while self.clock() < until:
            scan = self._turn()
            if scan is not None:
                return scan
            self._fill(until - self.clock())
        return None

    def close(self) -> None:
        """Stop scan and motor."""
        if self._port is not None:
            try:
                self._request(STOP)
                self._request(MOTOR, bytes(2))
                self._turn_motor(False)
                self._port.close()
            except Exception:  # it may be unplugged
                pass
            self._port = None

    # The protocol.

    def _turn_motor(self, on: bool) -> None:
        """Start or stop the motor of an A1, which turns while DTR is off."""
        with contextlib.suppress(OSError):  # a port without that line
            self._port.dtr = not on

    def _request(self, command: int, payload: bytes = b"") -> None:
        request = bytes([SYNC, command])
        if payload:
            request += bytes([len(payload)]) + payload
            check = 0
            for byte in request:
                check ^= byte
            request += bytes([check])
        self._port.write(request)

    def _fill(self, timeout: float) -> bool:
        """Read what has come; wait at most `timeout` seconds for something."""
        if not select.select([self._port], [], [], max(0.0, timeout))[0]:
            return False
        data = os.read(self._port.fileno(), 4096)
        if not data:
            raise BodyError(f"{self.parameters.device} does not respond any more")
        self._buffer += data
        return True

    def _until_quiet(self) -> None:
        """Drop what an earlier scan still sends."""
        until = self.clock() + ANSWER_WITHIN
        while self._fill(0.05) and self.clock() < until:
            self._buffer.clear()

    def _answer(self, begin: bytes, length: int) -> bytes:
        """Return the answer that begins so."""
        until = self.clock() + ANSWER_WITHIN
        while self.clock() < until:
            place = self._buffer.find(begin)
            end = place + len(begin) + length
            if place >= 0 and len(self._buffer) >= end:
                found = bytes(self._buffer[place + len(begin) : end])
                del self._buffer[:end]
                return found
            self._fill(until - self.clock())
        raise BodyError(f"{self.parameters.device}: no RPLIDAR answers; check `baud`")

    def _turn(self) -> Scan | None:
        """Take samples from the buffer until a turn is complete.

        A turn begins behind the lidar, where the beams of a scan do: they are then in order of
        time, as deskewing needs them.
        """
        while len(self._buffer) >= SAMPLE:
            first, low, high, near, far = self._buffer[:SAMPLE]
            if first & 1 == first >> 1 & 1 or not low & 1 or len(self._samples) > MOST_SAMPLES:
                del self._buffer[0]  # out of step: a byte was lost
                self._samples = self._samples[:MOST_SAMPLES]
                continue
            del self._buffer[:SAMPLE]
            angle, before = (low >> 1 | high << 7) / 64.0, self._angle
            self._angle = angle
            scan = self._completed() if 90.0 < before < 180.0 <= angle < 270.0 else None
            self._samples.append((radians(angle), (near | far << 8) / 4000.0))
            if scan is not None:
                return scan
        return None

    def _completed(self) -> Scan | None:
        """Return the turn that ends now, and begin the next; None for the first, a part of one."""
        now = self.clock()
        samples, self._samples = self._samples, []
        began, self._began = self._began, now
        if began is None or len(samples) < 3:
            return None
        lidar = self.lidar
        ranges = np.full(lidar.beams, nan, dtype=np.float32)
        sign = 1.0 if lidar.upside_down else -1.0  # clockwise seen from above, unless it hangs
        for angle, distance in samples:
            place = (sign * angle - lidar.angle_min + pi) % (2.0 * pi) - pi
            beam = round((place % (2.0 * pi)) / lidar.angle_increment)
            if not 0 <= beam < lidar.beams:
                if lidar.field_of_view < 2.0 * pi - 1e-6:
                    continue
                beam %= lidar.beams
            if distance == 0.0:
                value = inf
            elif distance < lidar.range_min:
                value = nan
            else:
                value = distance if distance <= lidar.range_max else inf
            if not ranges[beam] <= value:  # also in place of nan
                ranges[beam] = value
        turn = now - began
        return Scan(
            began + 0.5 * turn, ranges, lidar.angle_min, lidar.angle_increment, lidar.range_min,
            lidar.range_max, Pose2D(lidar.mount.x, lidar.mount.y, lidar.mount.heading),
            sign * turn * lidar.angle_increment / (2.0 * pi),
        )  # fmt: skip
