"""Scans as JSON datagrams, from any program on this machine that reads a lidar.

    {"stamp": 12.3, "angle_min": -3.14, "angle_increment": 0.0175, "ranges": [1.2, null, 99],
     "range_min": 0.1, "range_max": 12}

The names are those of ROS's LaserScan, in radians and metres, angles to the left. `null` is an
invalid beam, a range beyond `range_max` one without return. `stamp` is of the middle of the scan in
seconds of any clock; without it the time of arrival counts. `time_increment` may be given as well.
"""

from __future__ import annotations

import json
import select
import socket
from dataclasses import dataclass
from math import inf, isfinite, pi
from typing import Any

import numpy as np

from robots.sensor_drivers.kinds import SensorDriver
from stack.clock import DeviceClock
from stack.errors import BodyError
from stack.parameters import REQUIRED, parameter
from stack.types import Scan

LOOPBACK = "127.0.0.1"
LARGEST = 1 << 16
LEAST_BEAMS, MOST_BEAMS = 3, 8192
WAIT = 0.5


@dataclass(frozen=True)
class UdpScanParameters:
    """Where scans arrive: on this machine only."""

    port: int = parameter(
        REQUIRED, at_least=1024, at_most=65535, public=True, help="UDP port on 127.0.0.1"
    )


class UdpScanDriver(SensorDriver):
    """Receives scans."""

    Parameters = UdpScanParameters
    _socket: socket.socket | None = None

    def open(self) -> None:
        """Listen on the port."""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        try:
            self._socket.bind((LOOPBACK, self.parameters.port))
        except OSError as error:
            raise BodyError(f"port {self.parameters.port}: {error.strerror}") from None
        self._device = DeviceClock()

    def read(self) -> Scan | None:
        """Wait for a datagram; return the newest scan."""
        assert self._socket is not None
        if not select.select([self._socket], [], [], WAIT)[0]:
            return None
        data = b""
        for _ in range(100):  # the newest one, unless they come faster than they are read
            try:
                data = self._socket.recv(LARGEST)
            except BlockingIOError:
                break
        arrival = self.clock()
        try:
            return self._scan(json.loads(data), arrival)
        except (ValueError, TypeError, KeyError, RecursionError) as error:
            raise BodyError(f"port {self.parameters.port}: not a scan: {error!s:.100}") from None

    def _scan(self, given: dict[str, Any], arrival: float) -> Scan | None:
        """Return the scan of a datagram; None if its stamp is of no known clock.

        Raises:
            ValueError, TypeError, KeyError: it is none.
        """
        values = given["ranges"]
        if not LEAST_BEAMS <= len(values) <= MOST_BEAMS:
            raise ValueError(f"{len(values)} ranges; expected {LEAST_BEAMS} to {MOST_BEAMS}")
        ranges = np.array(values, dtype=np.float32)  # null becomes nan
        if ranges.ndim != 1:
            raise ValueError("ranges must be numbers")
        numbers = {
            name: float(given.get(name, default))
            for name, default in (
                ("angle_min", -pi), ("angle_increment", 2.0 * pi / len(values)),
                ("range_min", self.lidar.range_min), ("range_max", self.lidar.range_max),
                ("time_increment", 0.0),
            )
        }  # fmt: skip
        for name, number in numbers.items():
            if not isfinite(number):
                raise ValueError(f"{name} is {number}")
        if abs(numbers["angle_increment"]) * (len(values) - 1) > 2.0 * pi + 1e-3:
            raise ValueError("the beams are more than a full turn")
        ranges[ranges < numbers["range_min"]] = np.nan
        ranges[ranges > numbers["range_max"]] = inf
        stamp: float | None = arrival
        if given.get("stamp") is not None:
            stamp = self._device.convert(float(given["stamp"]), arrival)
        if stamp is None:
            return None
        return Scan(
            stamp, ranges, numbers["angle_min"], numbers["angle_increment"],
            numbers["range_min"], numbers["range_max"], self.lidar.mount,
            numbers["time_increment"],
        )  # fmt: skip

    def close(self) -> None:
        """Close the socket."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None
