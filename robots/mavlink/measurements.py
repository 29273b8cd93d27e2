"""Measurements of a rover: its messages as records of our stack, on our clock and in our frames."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, nan, pi, radians
from typing import Any

import numpy as np

from robots.mavlink.odometry import FilterOdometry, RoverOdometry, WheelOdometry
from stack.clock import DeviceClock
from stack.drivetrain.description import RobotDescription, SonarDescription
from stack.mavlink.frames import flu_from_frd
from stack.mavlink.link import Received
from stack.types import Battery, Imu, Measurement, Pose2D, RangeReading, Scan, wrap_angle

GRAVITY = 9.80665
"""m/s² of one g, in whose thousandths RAW_IMU and SCALED_IMU give accelerations."""

IMU_KINDS = {"HIGHRES_IMU": 3, "RAW_IMU": 2, "SCALED_IMU": 1}
"""Messages with inertial samples; only the best that comes is used."""

MOST_SAMPLES = 1000
"""Inertial samples that are kept for the next observation."""

BODY_FRD, GLOBAL = 12, 0
"""Frames of OBSTACLE_DISTANCE with angles from the rover's front; GLOBAL is the old value."""

UNKNOWN = 65535

NEAREST = radians(23.0)
"""Largest difference between the direction of a rangefinder and of the sonar that it is."""

FORWARD_SECTORS = 8
"""MAV_SENSOR_ROTATION_NONE to YAW_315: multiples of 45 degrees to the right."""

CHARGING = 7


class Stamps:
    """Stamps of messages on our clock: one device clock for each clock of the autopilot.

    `time_boot_ms` has 32 bits, and begins again after 49.7 days. `time_usec` counts from the start
    or from 1970, which may differ from message to message.
    """

    def __init__(self) -> None:
        self.clocks: dict[str, DeviceClock] = {}
        self._wraps, self._last = 0, 0

    def of(self, item: Received) -> float | None:
        """Time at which a message was measured, seconds on our clock; None if it is not known."""
        message = item.message
        milliseconds = getattr(message, "time_boot_ms", None)
        if milliseconds is not None:
            return self._clock("boot").convert(self._unwrapped(milliseconds) * 1e-3, item.at)
        microseconds = getattr(message, "time_usec", None)
        if microseconds is None:
            return item.at
        return self._clock(item.kind).convert(microseconds * 1e-6, item.at)

    def _clock(self, name: str) -> DeviceClock:
        return self.clocks.setdefault(name, DeviceClock())

    def _unwrapped(self, milliseconds: int) -> int:
        change = milliseconds - self._last
        if change < -(1 << 31):
            self._wraps += 1
        elif change > 1 << 31 and self._wraps:  # a late message of before
            return milliseconds + (self._wraps - 1 << 32)
        self._last = milliseconds
        return milliseconds + (self._wraps << 32)


class Measurements:
    """Collects the measurements between two observations.

    Args:
        robot: with the sensors that are used.
        odometry: auto, wheels or ekf.
        lidar: name of the lidar that OBSTACLE_DISTANCE is the scan of; may be empty.
        rangefinders: names of sonars by id of DISTANCE_SENSOR; empty: by direction.

    Attributes:
        stamps: converts the autopilot's clocks.
        battery: newest state of charge; None before the first.
    """

    def __init__(
        self, robot: RobotDescription, odometry: str, lidar: str, rangefinders: tuple[str, ...]
    ) -> None:
        self._robot, self.stamps = robot, Stamps()
        self._filter = FilterOdometry()
        sided = robot.drivetrain.track > 0.0 and not robot.drivetrain.steering_joints
        self._wheels = WheelOdometry(robot.drivetrain) if sided and odometry != "ekf" else None
        self._odometry, self._rangefinders = odometry, rangefinders
        self._lidar = robot.real_lidars.get(lidar)
        self._lidar_name = lidar
        self._new: dict[str, Measurement] = {}
        self._imu_kind, self._samples = "", list[tuple[float, tuple[float, ...]]]()
        self._last_sample, self._has_battery_status = -inf, False
        self.battery: Battery | None = None
        self._readers: dict[str, Callable[[Any, float], None]] = {
            "OBSTACLE_DISTANCE": self._obstacles,
            "DISTANCE_SENSOR": self._distance,
            "BATTERY_STATUS": self._battery_status,
            "SYS_STATUS": self._sys_status,
        }
        if robot.imu is not None:
            self._readers |= {
                "RAW_IMU": lambda m, t: self._imu("RAW_IMU", m, t, GRAVITY * 1e-3, 1e-3),
                "SCALED_IMU": lambda m, t: self._imu("SCALED_IMU", m, t, GRAVITY * 1e-3, 1e-3),
                "HIGHRES_IMU": lambda m, t: self._imu("HIGHRES_IMU", m, t, 1.0, 1.0),
            }

    @property
    def odometry(self) -> RoverOdometry:
        """The odometry that is used: of the wheels, if they are chosen or there."""
        if self._wheels is not None and (
            self._odometry == "wheels" or self._wheels.stamp is not None
        ):
            return self._wheels
        return self._filter

    @property
    def source(self) -> str:
        """Messages that the odometry needs, for people."""
        if self.odometry is self._wheels:
            return "WHEEL_DISTANCE"
        return "ATTITUDE and LOCAL_POSITION_NED"

    def add(self, item: Received) -> None:
        """Process a message."""
        kind = item.kind
        reader = self._readers.get(kind)
        moves = kind in ("ATTITUDE", "LOCAL_POSITION_NED", "WHEEL_DISTANCE")
        if reader is None and not moves:
            return
        stamp = self.stamps.of(item)
        if stamp is None:
            return
        if reader is not None:
            reader(item.message, stamp)
            return
        odometry = self._wheels if kind == "WHEEL_DISTANCE" else self._filter
        if odometry is None:
            return
        before = odometry.stamp
        odometry.add(kind, item.message, stamp)
        if odometry.stamp != before:
            odometry.heard = item.at

    def take(self) -> dict[str, Measurement]:
        """Return the new measurements by sensor name, without odometry; the next call has others.

        Stamps are on the clock of the link.
        """
        found, self._new = self._new, {}
        if self._samples:
            samples, self._samples = self._samples, []
            values = np.array([sample for _, sample in samples])
            stamps = np.array([stamp for stamp, _ in samples])
            found["imu"] = Imu(stamps, values[:, :3], values[:, 3:])
        return found

    def _imu(self, kind: str, m: Any, stamp: float, metres: float, radians_: float) -> None:
        if kind != self._imu_kind:
            if IMU_KINDS[kind] < IMU_KINDS.get(self._imu_kind, 0):
                return
            self._imu_kind = kind
        if stamp <= self._last_sample or len(self._samples) >= MOST_SAMPLES:
            return
        self._last_sample = stamp
        gyro = flu_from_frd((m.xgyro * radians_, m.ygyro * radians_, m.zgyro * radians_))
        force = flu_from_frd((m.xacc * metres, m.yacc * metres, m.zacc * metres))
        self._samples.append((stamp, (*gyro, *force)))

    def _obstacles(self, m: Any, stamp: float) -> None:
        """A scan: its angles run to the right, ours to the left, so the beams are reversed."""
        lidar = self._lidar
        if lidar is None or m.frame not in (BODY_FRD, GLOBAL):
            return
        increment = m.increment_f or float(m.increment)
        raw = np.array(m.distances, dtype=np.float64)
        count = raw.size if increment == 0.0 else min(raw.size, int(360.0 / abs(increment) + 0.5))
        raw = raw[:count]
        if increment == 0.0 or count < 2:
            return
        ranges = raw * 0.01
        ranges[raw > m.max_distance] = inf
        ranges[raw == UNKNOWN] = nan
        ranges[raw < m.min_distance] = nan
        first = radians(m.angle_offset)
        last = first + radians(increment) * (count - 1)
        if increment > 0.0:
            ranges, begin = ranges[::-1], -last
        else:
            begin = -first
        begin = wrap_angle(begin)
        if count * abs(increment) > 359.0:
            # A full turn begins anywhere; ours begin behind the robot.
            shift = round((begin + pi) / radians(abs(increment)))
            ranges, begin = np.roll(ranges, shift), begin - shift * radians(abs(increment))
        self._new[self._lidar_name] = Scan(
            stamp, np.ascontiguousarray(ranges, dtype=np.float32), begin, radians(abs(increment)),
            m.min_distance * 0.01, m.max_distance * 0.01, Pose2D(lidar.mount.x, lidar.mount.y),
        )  # fmt: skip

    def _distance(self, m: Any, stamp: float) -> None:
        name = self._sonar_of(m)
        if not name:
            return
        sonar = self._robot.sonars[name]
        least, most = m.min_distance * 0.01, m.max_distance * 0.01
        distance = m.current_distance * 0.01
        if distance < least or m.signal_quality == 1:
            distance = nan
        elif distance >= most:
            distance = inf
        field = float(m.horizontal_fov) or sonar.field_of_view
        self._new[name] = RangeReading(stamp, distance, field, least, most, sonar.mount, name)

    def _sonar_of(self, m: Any) -> str:
        """Name of the sonar that a DISTANCE_SENSOR is; empty if it is none."""
        if self._rangefinders:
            return self._rangefinders[m.id] if m.id < len(self._rangefinders) else ""
        if m.orientation >= FORWARD_SECTORS:
            return ""
        direction = wrap_angle(-m.orientation * pi / 4.0)

        def aside(sonar: SonarDescription) -> float:
            return abs(wrap_angle(sonar.mount.heading - direction))

        near = {name: aside(sonar) for name, sonar in self._robot.sonars.items()}
        best = min(near, key=near.__getitem__, default="")
        return best if best and near[best] <= NEAREST else ""

    def _battery_status(self, m: Any, stamp: float) -> None:
        if m.id != 0:
            return
        cells = [value for value in m.voltages if value != UNKNOWN]
        self._has_battery_status = True
        self._charge(
            m.battery_remaining, sum(cells) * 1e-3 if cells else 0.0,
            m.charge_state == CHARGING, stamp,
        )  # fmt: skip

    def _sys_status(self, m: Any, stamp: float) -> None:
        if not self._has_battery_status and m.voltage_battery != UNKNOWN:
            self._charge(m.battery_remaining, m.voltage_battery * 1e-3, False, stamp)

    def _charge(self, percent: int, voltage: float, charging: bool, stamp: float) -> None:
        if percent >= 0:
            charge = min(percent, 100) / 100.0
        elif voltage > 0.0:
            charge = self._robot.battery.charge_at(voltage)
        else:
            return
        self.battery = Battery(charge, charging, voltage, stamp)
        self._new["battery"] = self.battery
