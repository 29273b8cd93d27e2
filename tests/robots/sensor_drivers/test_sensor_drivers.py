"""Drivers of lidars: an emulated RPLIDAR on a pseudo-terminal, and datagrams over loopback."""

import json
import math
import os
import pty
import socket
import threading
import tty
from dataclasses import replace
from pathlib import Path
from time import monotonic, sleep  # noqa: TID251 - real sensors have the wall clock

import numpy as np
import pytest

from robots.load import find_robot, read_robot
from robots.sensor_drivers.readers import SensorReaders
from robots.sensor_drivers.rplidar import HEALTH_ANSWER, SCAN_ANSWER
from stack.errors import InputError

SCOUT = find_robot("scout", Path(__file__))
SAMPLES = 360


def room(angle):
    """Distance to the walls of a room, clockwise from ahead: 2 m ahead, 1 m right, 3 m behind and
    left, metres; nothing within reach from 100° to 110°."""
    if 100.0 < math.degrees(angle) % 360.0 < 110.0:
        return 0.0
    ahead, right = math.cos(angle), math.sin(angle)
    return min((2.0 if ahead > 0 else 3.0) / max(abs(ahead), 1e-9),
               (1.0 if right > 0 else 3.0) / max(abs(right), 1e-9))  # fmt: skip


class EmulatedRplidar:
    """Answers as an A1 does, and turns at 10 Hz."""

    def __init__(self, error=0, corrupt=False):
        self.error, self.corrupt = error, corrupt
        self.near, self.far = pty.openpty()
        tty.setraw(self.far)
        tty.setraw(self.near)
        self.device = os.ttyname(self.far)
        self.requests, self.ended = [], threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def close(self):
        self.ended.set()
        self._thread.join(2.0)
        os.close(self.near)
        os.close(self.far)

    def _run(self):
        os.set_blocking(self.near, False)
        scanning, degree = False, 0
        while not self.ended.is_set():
            try:
                data = os.read(self.near, 100)
            except BlockingIOError:
                data = b""
            while data:
                command = data[1]
                self.requests.append(command)
                data = data[6:] if command == 0xF0 else data[2:]
                if command == 0x25:
                    scanning = False
                elif command == 0x52:
                    status = bytes([2 if self.error else 0, self.error, 0])
                    self._write(HEALTH_ANSWER + status)
                elif command == 0x20:
                    scanning, degree = True, 0
                    self._write(SCAN_ANSWER)
            if scanning:
                block = b"".join(self._sample(degree + n) for n in range(36))
                if self.corrupt and degree == 72:
                    block = block[:50] + block[51:]  # a byte is lost
                self._write(block)
                degree = (degree + 36) % 360
            sleep(0.01)

    def _write(self, data):
        try:
            os.write(self.near, data)
        except BlockingIOError:
            pass

    def _sample(self, degree):
        begins = degree % 360 == 0
        angle, distance = int(degree % 360 * 64), round(room(math.radians(degree)) * 4000)
        return bytes([15 << 2 | (1 if begins else 2), angle << 1 & 0xFF | 1, angle >> 7,
                      distance & 0xFF, distance >> 8])  # fmt: skip


@pytest.fixture
def readers():
    made = []

    def make(**drivers):
        robot = replace(read_robot(SCOUT), sensor_drivers=drivers)
        made.append(SensorReaders(robot))
        return made[-1]

    yield make
    for one in made:
        one.close()


def wait_for(condition, longest=5.0):
    end = monotonic() + longest
    while not (found := condition()):
        assert monotonic() < end, "it did not happen"
        sleep(0.01)
    return found


def taken(reader):
    return lambda: reader.take(0.0, math.inf).get("lidar")


@pytest.mark.parametrize("corrupt", [False, True])
def test_an_rplidar_shows_the_room(readers, corrupt):
    lidar = EmulatedRplidar(corrupt=corrupt)
    try:
        began = monotonic()
        reader = readers(lidar=("rplidar", {"device": lidar.device}))
        scans = [wait_for(taken(reader)) for _ in range(3)]
        scan = scans[-1]
        assert scan.ranges.shape == (360,) and reader.problem == ""
        at = {round(math.degrees(a)): r for a, r in zip(scan.angles, scan.ranges, strict=True)}
        # Clockwise angles of the device are negative in our frame.
        assert at[0] == pytest.approx(2.0, abs=1e-3) and at[-90] == pytest.approx(1.0, abs=1e-3)
        assert at[90] == pytest.approx(3.0, abs=1e-3) and at[-45] == pytest.approx(1.414, abs=1e-3)
        assert at[-105] == math.inf
        assert np.isnan(scan.ranges).sum() <= (10 if corrupt else 0)
        assert began < scan.stamp < monotonic()
        # A turn takes some 0.1 s; from left to right, so that later beams have smaller angles.
        assert scan.time_increment < 0.0
        reader.close()
        wait_for(lambda: lidar.requests[-2:] == [0x25, 0xF0])  # scan and motor are stopped
    finally:
        lidar.close()


def test_faults_of_an_rplidar_are_told_in_its_words(readers, tmp_path):
    lidar = EmulatedRplidar(error=4)
    try:
        reader = readers(lidar=("rplidar", {"device": lidar.device}))
        wait_for(lambda: "the lidar reports error 4" in reader.problem)
    finally:
        lidar.close()
    reader = readers(lidar=("rplidar", {"device": "/dev/tty_of_nobody"}))
    wait_for(lambda: "lidar: /dev/tty_of_nobody: No such file" in reader.problem)


@pytest.fixture
def sender():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
        yield (
            port,
            lambda data: out.sendto(
                data if isinstance(data, bytes) else json.dumps(data).encode(), ("127.0.0.1", port)
            ),
        )


def test_scans_by_datagram(readers, sender):
    port, send = sender
    reader = readers(lidar=("udp_scan", {"port": port}))
    ranges = [1.0, None, 99.0, 0.01, *[2.0] * 356]

    def arrived(stamp):
        send({"angle_min": -3.0, "angle_increment": 0.0174, "ranges": ranges, "stamp": stamp,
              "range_max": 10.0, "range_min": 0.1})  # fmt: skip
        return taken(reader)()

    first = wait_for(lambda: arrived(5000.0 + monotonic()))
    assert first.angle_min == -3.0 and first.ranges[0] == 1.0 and first.range_max == 10.0
    assert math.isnan(first.ranges[1]) and first.ranges[2] == math.inf
    assert math.isnan(first.ranges[3])
    assert abs(first.stamp - monotonic()) < 1.0  # the sender's clock was converted
    assert reader.take(0.0, math.inf) == {}  # each scan once


@pytest.mark.parametrize(
    "data",
    [
        b"hello", b"\xff\xfe", b"[]", {"ranges": [1.0]}, {"ranges": ["a"] * 10}, {"range": [1] * 9},
        {"ranges": [1.0] * 10, "angle_increment": 1.0}, {"ranges": [[1.0]] * 10},
        {"ranges": [1.0] * 10, "range_max": math.nan}, b"[" * 50_000,
    ],
)  # fmt: skip
def test_what_is_no_scan_is_told_and_harmless(readers, sender, data):
    port, send = sender
    reader = readers(lidar=("udp_scan", {"port": port}))

    def told():
        send(data)
        return f"lidar: port {port}: not a scan" in reader.problem

    wait_for(told)
    assert reader.take(0.0, math.inf) == {}
    wait_for(lambda: (send({"ranges": [1.0] * 10}), taken(reader)())[1])
    assert reader.problem == ""


def test_the_robot_file_names_drivers(tmp_path):
    def read(sensors):
        text = SCOUT.read_text().replace("scout.urdf", str(SCOUT.parent / "scout.urdf"))
        file = tmp_path / "robot.yaml"
        file.write_text(f"{text}\nsensors: {sensors}\n")
        return read_robot(file)

    robot = read("{lidar: {use: rplidar, device: /dev/ttyUSB0}}")
    assert robot.sensor_drivers == {"lidar": ("rplidar", {"device": "/dev/ttyUSB0"})}
    for sensors, problem in (
        ("{lidr: {use: rplidar, device: /dev/x}}", "has no lidar 'lidr'; did you mean 'lidar'"),
        ("{lidar: {use: rplider, device: /dev/x}}", "no sensor driver 'rplider'; did you mean"),
        ("{lidar: {use: rplidar}}", "device"),
        ("{lidar: {use: udp_scan, port: 80}}", "port"),
        ("{lidar: {port: 8000}}", "must be a mapping with `use`"),
    ):
        with pytest.raises(InputError, match=problem):
            read(sensors)
