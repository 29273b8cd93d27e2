"""An emulated ArduRover for tests: what the real one did on the wire, without its firmware.

Measured on ArduRover 4.7 in its own simulator (skid-steered, real time): the mode and arming are
refused for a while with texts; setpoints are taken only in GUIDED and armed; other frames than
LOCAL_NED, LOCAL_OFFSET_NED, BODY_NED and BODY_OFFSET_NED, and setpoints with acceleration, are
dropped without a word; a negative vx without yaw rate turns the rover round; without setpoints it
says so after 2.9 s and stops after 3 s; without heartbeats of MAV_GCS_SYSID it goes to HOLD after
6.5 s, if FS_GCS_ENABLE is set; it never leaves HOLD by itself. The link can delay and lose
messages, and the rover's clock has an offset and a drift.

    python -m tests.robots.mavlink.emulated_rover PORT      # as a process, until it is killed
"""

from __future__ import annotations

import contextlib
import heapq
import random
import socket
import sys
import threading
from dataclasses import dataclass, field
from math import cos, hypot, inf, pi, sin
from time import monotonic, sleep  # noqa: TID251 - a real robot's clock

from pymavlink.dialects.v20 import all as d

from stack.mavlink.signing import Signing, signed_codecs

STEP = 0.005
PX4 = 12
OFFBOARD = 6 << 16
MODES = {"MANUAL": 0, "HOLD": 4, "AUTO": 10, "GUIDED": 15, "INITIALISING": 16}
NAMES = {number: name for name, number in MODES.items()}
TAKEN_FRAMES = (1, 7, 8, 9)
LAG = 0.15
"""Time constant of the drive, s."""

ROOM = 4.0
"""The rover is in a square room; half its side, metres."""


@dataclass
class Settings:
    """How the rover and its link behave; times in seconds."""

    system: int = 1
    position_after: float = 0.3
    refuses_arming: int = 1
    autopilot: int = 3
    refusal: str = "Arm: AHRS: not using configured AHRS type"
    setpoint_timeout: float = 3.0
    station_timeout: float = 6.5
    loss: float = 0.0
    delay: float = 0.002
    jitter: float = 0.0
    clock_offset: float = 1234.5
    clock_drift: float = 5e-5
    noise: float = 0.0
    wheels: bool = False
    vision_only: bool = False
    battery: int = 87
    never_answers: tuple[str, ...] = ()
    parameters: dict[str, float] = field(
        default_factory=lambda: {"FS_GCS_ENABLE": 0.0, "MAV_GCS_SYSID": 255.0}
    )
    seed: int = 1
    key: bytes | None = None


class EmulatedRover:
    """The rover. `run` is its main loop; the tests read and set its attributes meanwhile.

    Its truth is north, east and yaw, metres and radians.
    """

    def __init__(self, settings: Settings | None = None, now=monotonic) -> None:
        self.settings, self._now = settings or Settings(), now
        self._random = random.Random(self.settings.seed)
        if self.settings.key is None:
            self._mav = d.MAVLink(None, self.settings.system, 1)
        else:
            self._mav = signed_codecs(Signing(self.settings.key))(self.settings.system, 1)
        self._mav.robust_parsing = True
        self.ended = threading.Event()
        self.silent = False
        self.north = self.east = self.yaw = 0.0
        self.speed = self.rate = 0.0
        self.received: dict[str, int] = {}
        self.setpoints: list[tuple[float, float, float]] = []
        self.visions: list = []
        self.origin = None
        self.boots = 0
        self.rolled = [0.0, 0.0]
        self.boot()

    def boot(self) -> None:
        """Start again, as after a loss of power; the place stays."""
        self.boots += 1
        self._began = self._now()
        self.mode, self.armed = MODES["MANUAL"], False
        self._rates: dict[int, float] = {}
        self._due: dict[int, float] = {}
        self._setpoint, self._setpoint_at, self._warned = (0.0, 0.0), -inf, False
        self._turns_round = False
        self._station_at = inf
        self._outbox: list = []
        self._count = 0
        self._beat_due = 0.0
        self._refusals = self.settings.refuses_arming
        self._last = self._now()

    # Time.

    @property
    def uptime(self) -> float:
        return self._now() - self._began

    @property
    def clock(self) -> float:
        """The rover's own clock."""
        settings = self.settings
        offset = settings.clock_offset if self.boots == 1 else 0.0
        return self.uptime * (1.0 + settings.clock_drift) + offset

    @property
    def ms(self) -> int:
        return int(self.clock * 1e3)

    @property
    def us(self) -> int:
        return int(self.clock * 1e6)

    # The loop.

    def run(self, port: int) -> None:
        """Talk UDP with a station in real time until `ended` is set."""
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
            link.bind(("127.0.0.1", 0))
            link.setblocking(False)
            while not self.ended.is_set():
                with contextlib.suppress(BlockingIOError, ConnectionError):
                    while True:
                        self.take(link.recvfrom(4096)[0])
                for frame in self.step():
                    with contextlib.suppress(ConnectionError):
                        link.sendto(frame, ("127.0.0.1", port))
                sleep(STEP)

    def take(self, data: bytes) -> None:
        """Receive a datagram, if it is not lost."""
        if self.silent or self._random.random() < self.settings.loss:
            return
        for message in self._mav.parse_buffer(data) or []:
            kind = message.get_type()
            if getattr(message, "target_system", 0) not in (0, self.settings.system):
                continue
            self.received[kind] = self.received.get(kind, 0) + 1
            handler = getattr(self, f"on_{kind.lower()}", None)
            if handler is not None and kind not in self.settings.never_answers:
                handler(message)

    def step(self) -> list[bytes]:
        """Drive until now; return the frames that arrive at the station now."""
        now = self._now()
        self._drive(min(now - self._last, 0.1))
        self._last = now
        self._stream()
        arrived = []
        while self._outbox and self._outbox[0][0] <= now:
            arrived.append(heapq.heappop(self._outbox)[2])
        return arrived

    def send(self, message) -> None:
        settings = self.settings
        frame = bytes(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256
        if self.silent or self._random.random() < settings.loss:
            return
        delay = settings.delay
        if settings.jitter:
            delay += self._random.expovariate(1.0 / settings.jitter)
        self._count += 1
        heapq.heappush(self._outbox, (self._now() + delay, self._count, frame))

    # Driving.

    def set_mode(self, name: str) -> None:
        """Change the mode, as the pilot's transmitter does."""
        self.mode = MODES[name]

    def _drive(self, dt: float) -> None:
        s, age = self.settings, self._now() - self._setpoint_at
        if self.mode in (MODES["GUIDED"], OFFBOARD) and self.armed and age < inf:
            if age > s.setpoint_timeout - 0.1 and not self._warned:
                self._warned = True
                self.text("target not received last 3secs, stopping")
            if age > s.setpoint_timeout:
                self._setpoint = (0.0, 0.0)
        elif self.mode != MODES["MANUAL"]:
            self._setpoint = (0.0, 0.0)
        gone = self._now() - self._station_at
        if self.armed and s.parameters["FS_GCS_ENABLE"] and gone > s.station_timeout:
            if self.mode == MODES["GUIDED"]:
                self.text("Radio Failsafe")
                self.mode = MODES["HOLD"]
        wanted = self._setpoint if self.armed else (0.0, 0.0)
        share = min(1.0, dt / LAG)
        self.speed += share * (wanted[0] - self.speed)
        self.rate += share * (wanted[1] - self.rate)
        turn = self.rate * dt
        self.north += self.speed * dt * cos(self.yaw + turn / 2)
        self.east += self.speed * dt * sin(self.yaw + turn / 2)
        self.yaw = (self.yaw + turn + pi) % (2 * pi) - pi
        for side, sign in ((0, 1.0), (1, -1.0)):  # 29 cm between left and right; yaw is clockwise
            self.rolled[side] += (self.speed + sign * self.rate * 0.145) * dt

    def on_set_position_target_local_ned(self, m) -> None:
        self.setpoints.append((self._now(), m.vx, m.yaw_rate))
        if m.coordinate_frame not in TAKEN_FRAMES or m.type_mask & 0x1C0 != 0x1C0:
            return  # dropped silently
        if m.type_mask & 0x38 or m.coordinate_frame not in (8, 9):
            return  # positions and world frames are not emulated
        if self.mode not in (MODES["GUIDED"], OFFBOARD):
            return
        if m.type_mask & 0x800 and m.vx < 0.0:
            self._setpoint = (-m.vx, 1.0)  # turns round and drives forward
        else:
            self._setpoint = (m.vx, 0.0 if m.type_mask & 0x800 else m.yaw_rate)
        self._setpoint_at, self._warned = self._now(), False

    # Services.

    def text(self, text: str, severity: int = 2) -> None:
        self.send(d.MAVLink_statustext_message(severity, text.encode()[:50]))

    def acknowledge(self, m, result: int) -> None:
        self.send(
            d.MAVLink_command_ack_message(
                m.command, result, 0, 0, m.get_srcSystem(), m.get_srcComponent()
            )
        )

    @property
    def has_position(self) -> bool:
        if self.settings.vision_only:
            fresh = self.visions and self._now() - self.visions[-1][0] < 0.3
            return bool(self.origin and fresh)
        return self.uptime > self.settings.position_after

    def on_heartbeat(self, m) -> None:
        if m.get_srcSystem() == self.settings.parameters["MAV_GCS_SYSID"]:
            self._station_at = self._now()

    def on_command_long(self, m) -> None:
        if m.command == 511:
            self._rates[int(m.param1)] = 1e6 / m.param2
            self._due[int(m.param1)] = self.clock
            self.acknowledge(m, 0 if int(m.param1) in self._streams() else 4)
        elif m.command == 176 and self.settings.autopilot == PX4:
            streamed = len([at for at, _, _ in self.setpoints if self._now() - at < 1.0]) >= 3
            accepted = int(m.param1) & 1 and int(m.param2) == 6 and streamed
            self.mode = OFFBOARD if accepted else self.mode
            self.acknowledge(m, 0 if accepted else 1)
        elif m.command == 176:
            if int(m.param2) == MODES["GUIDED"] and not self.has_position:
                self.text("Mode change to GUIDED failed: requires position")
                self.acknowledge(m, 4)
            elif int(m.param1) & 1 and int(m.param2) in NAMES:
                self.mode = int(m.param2)
                self.acknowledge(m, 0)
            else:
                self.acknowledge(m, 4)
        elif m.command == 400:
            if m.param1 == 1.0 and self._refusals > 0:
                self._refusals -= 1
                self.text(self.settings.refusal)
                self.acknowledge(m, 4)
            else:
                self.armed = m.param1 == 1.0
                self.acknowledge(m, 0)
        else:
            self.acknowledge(m, 3)

    def on_param_request_read(self, m) -> None:
        name = m.param_id
        if name in self.settings.parameters:
            value = self.settings.parameters[name]
            self.send(d.MAVLink_param_value_message(name.encode(), value, 9, 1000, 1))

    def on_timesync(self, m) -> None:
        if m.tc1 == 0:
            self.send(d.MAVLink_timesync_message(int(self.clock * 1e9), m.ts1))

    def on_set_gps_global_origin(self, m) -> None:
        self.origin = (m.latitude, m.longitude)
        self.send(d.MAVLink_gps_global_origin_message(m.latitude, m.longitude, 0))

    def on_vision_position_estimate(self, m) -> None:
        self.visions.append((self._now(), m.x, m.y, m.yaw, m.reset_counter))

    def on_odometry(self, m) -> None:
        if m.frame_id == 20 and m.child_frame_id == 12:  # others are dropped silently
            self.visions.append((self._now(), m.x, m.y, m.q, m.reset_counter))

    # Streams.

    def _streams(self) -> dict:
        streams = {
            30: self._attitude, 32: self._position, 27: self._imu, 147: self._battery,
            330: self._obstacles, 132: self._rangefinder, 1: self._status,
        }  # fmt: skip
        return {**streams, 9000: self._wheel_distance} if self.settings.wheels else streams

    def _stream(self) -> None:
        if self.uptime >= self._beat_due:
            self._beat_due += 1.0
            flags = 0x01 | (0x80 if self.armed else 0)
            self.send(
                d.MAVLink_heartbeat_message(10, self.settings.autopilot, flags, self.mode, 4, 3)
            )
        now = self.clock
        for number, make in self._streams().items():
            rate = self._rates.get(number, 0.0)
            if rate > 0.0 and now >= self._due[number]:
                self._due[number] = max(self._due[number] + 1.0 / rate, now - 1.0)
                make()

    def _noise(self, deviation: float) -> float:
        return self._random.gauss(0.0, deviation * self.settings.noise) if deviation else 0.0

    def _attitude(self) -> None:
        yaw, rate = self.yaw + self._noise(0.005), self.rate + self._noise(0.01)
        self.send(d.MAVLink_attitude_message(self.ms, 0.0, 0.0, yaw, 0.0, 0.0, rate))

    def _position(self) -> None:
        if not self.has_position:
            return
        north = self.speed * cos(self.yaw) + self._noise(0.02)
        east = self.speed * sin(self.yaw) + self._noise(0.02)
        self.send(
            d.MAVLink_local_position_ned_message(
                self.ms, self.north, self.east, 0.0, north, east, 0.0
            )
        )

    def _imu(self) -> None:
        gyro = round((self.rate + self._noise(0.004)) * 1e3)
        self.send(d.MAVLink_raw_imu_message(self.us, 0, 0, -1000, 0, 0, gyro, 0, 0, 0))

    def _wheel_distance(self) -> None:
        distance = [*self.rolled, *[0.0] * 14]
        self.send(d.MAVLink_wheel_distance_message(self.us, 2, distance))

    def _battery(self) -> None:
        cells = [12600, *[65535] * 9]
        self.send(
            d.MAVLink_battery_status_message(
                0, 0, 0, 32767, cells, -1, -1, -1, self.settings.battery
            )
        )

    def _status(self) -> None:
        self.send(
            d.MAVLink_sys_status_message(
                0, 0, 0, 0, 12600, -1, self.settings.battery, 0, 0, 0, 0, 0, 0
            )
        )

    def range_at(self, bearing: float) -> float:
        """Distance to the wall of the room in a direction clockwise from the front, metres."""
        direction = self.yaw + bearing
        north, east = cos(direction), sin(direction)
        ways = [
            ((ROOM if along > 0 else -ROOM) - place) / along
            for along, place in ((north, self.north), (east, self.east))
            if abs(along) > 1e-9
        ]
        return max(0.0, min(ways))

    def _obstacles(self) -> None:
        ranges = [self.range_at(n * pi / 36.0) + self._noise(0.01) for n in range(72)]
        distances = [min(max(round(100 * r), 0), 1201) for r in ranges]
        self.send(
            d.MAVLink_obstacle_distance_message(self.us, 0, distances, 0, 10, 1200, 5.0, 0.0, 12)
        )

    def _rangefinder(self) -> None:
        for number, orientation in ((0, 7), (1, 0), (2, 1)):
            distance = min(round(100 * self.range_at(orientation * pi / 4.0)), 400)
            self.send(
                d.MAVLink_distance_sensor_message(
                    self.ms, 5, 400, distance, 0, number, orientation, 255
                )
            )

    @property
    def driven(self) -> float:
        return hypot(self.north, self.east)


if __name__ == "__main__":
    EmulatedRover().run(int(sys.argv[1]))
