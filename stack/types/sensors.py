"""Measurements: scans, ranges, odometry, inertial samples, images, depth images, battery."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from stack.types.camera import CameraModel
from stack.types.geometry import FloatArray, Pose2D, Twist


@dataclass(frozen=True, slots=True)
class Scan:
    """One scan of a planar lidar.

    Attributes:
        stamp: seconds on the body's clock, at the middle of the scan.
        ranges: (n,) float32 metres; +inf: no return; NaN: invalid or below the minimum.
        angle_min: direction of beam 0 in the sensor frame, radians.
        angle_increment: angle from beam to beam, radians.
        range_min: metres.
        range_max: metres.
        mount: the sensor's pose in the base frame.
        time_increment: seconds from beam to beam; 0: all beams are measured at `stamp`.
        bearings: (n,) beam directions in the sensor frame at `stamp`, radians; None: evenly spaced
            from `angle_min`. Deskewed scans have them (stack.frames.deskew).
    """

    stamp: float
    ranges: NDArray[np.float32]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    mount: Pose2D = Pose2D(0.0, 0.0)
    time_increment: float = 0.0
    bearings: FloatArray | None = None

    @property
    def stamps(self) -> FloatArray:
        """(n,) times at which the beams are measured, seconds."""
        beams = np.arange(self.ranges.size, dtype=np.float64)
        return self.stamp + self.time_increment * (beams - 0.5 * (beams.size - 1))

    @property
    def interval(self) -> tuple[float, float]:
        """Times of the earliest and the latest beam, seconds."""
        half = abs(self.time_increment) * 0.5 * (self.ranges.size - 1)
        return self.stamp - half, self.stamp + half

    @property
    def angles(self) -> FloatArray:
        """(n,) beam directions in the sensor frame, radians."""
        if self.bearings is not None:
            return self.bearings
        return self.angle_min + self.angle_increment * np.arange(self.ranges.size, dtype=np.float64)

    def with_ranges(self, ranges: NDArray[np.float32]) -> Scan:
        """Return the scan with other ranges (n,) along its beams."""
        return Scan(
            self.stamp, ranges, self.angle_min, self.angle_increment, self.range_min,
            self.range_max, self.mount, self.time_increment, self.bearings,
        )  # fmt: skip

    def points(self) -> FloatArray:
        """(m, 2) end points of the beams that returned, in the base frame, metres."""
        hit = np.isfinite(self.ranges)
        ranges, angles = self.ranges[hit].astype(np.float64), self.angles[hit]
        return self.mount.transform(
            np.column_stack([ranges * np.cos(angles), ranges * np.sin(angles)])
        )


@dataclass(frozen=True, slots=True)
class RangeReading:
    """One reading of a sonar or similar sensor: distance to the nearest obstacle in a cone.

    Attributes:
        stamp: seconds on the body's clock.
        distance: metres; +inf: no return; NaN: invalid or below the minimum.
        field_of_view: full opening angle of the cone, radians.
        range_min: metres; shorter readings are invalid.
        range_max: metres; longer readings are no return.
        mount: the sensor's pose in the base frame.
        source: the sensor's name.
    """

    stamp: float
    distance: float
    field_of_view: float
    range_min: float
    range_max: float
    mount: Pose2D = Pose2D(0.0, 0.0)
    source: str = "sonar"


NO_COVARIANCE: FloatArray = np.zeros((3, 3))
NO_COVARIANCE.flags.writeable = False


@dataclass(frozen=True, slots=True)
class Odometry:
    """Dead reckoning: pose in the odom frame, which drifts but never jumps, and velocity.

    Attributes:
        stamp: seconds on the body's clock.
        pose: odom frame.
        twist: measured velocity, base frame.
        step_covariance: (3, 3) of the displacement since the previous odometry, base frame at its
            end; zeros where the source states no error.
        disturbed: whether the wheels disagree with another sensor: they slip, or the robot was
            pushed.
    """

    stamp: float
    pose: Pose2D
    twist: Twist
    step_covariance: FloatArray = field(default_factory=lambda: NO_COVARIANCE)
    disturbed: bool = False


@dataclass(frozen=True, slots=True)
class Imu:
    """The IMU samples since the last observation, base frame.

    Attributes:
        stamps: (n,) seconds.
        angular_velocity: (n, 3) rad/s.
        linear_acceleration: (n, 3) specific force, m/s² (+9.81 on z at rest).
    """

    stamps: FloatArray
    angular_velocity: FloatArray
    linear_acceleration: FloatArray

    @property
    def stamp(self) -> float:
        """Time of the newest sample, seconds."""
        return float(self.stamps[-1])


@dataclass(frozen=True, slots=True)
class Image:
    """A camera picture: pixels (height, width, 3) uint8 RGB, stamped at mid-exposure."""

    stamp: float
    pixels: NDArray[np.uint8]
    camera: CameraModel


@dataclass(frozen=True, slots=True)
class DepthImage:
    """A picture of distances, stamped at mid-exposure.

    Attributes:
        stamp: seconds on the body's clock.
        depth: (height, width) float32 metres along the optical axis; +inf: no return; NaN: invalid
            or below the minimum.
        camera: model and mount.
        range_min: metres along the optical axis.
        range_max: metres along the optical axis.
    """

    stamp: float
    depth: NDArray[np.float32]
    camera: CameraModel
    range_min: float
    range_max: float


@dataclass(frozen=True, slots=True)
class PointCloud:
    """Points that a depth camera has seen.

    Attributes:
        stamp: of the picture, seconds on the body's clock.
        points: (n, 3) base frame at the stamp, metres.
    """

    stamp: float
    points: FloatArray


@dataclass(frozen=True, slots=True)
class Battery:
    """State of the battery: charge in [0, 1], whether it is charging, voltage in volts."""

    charge: float
    charging: bool = False
    voltage: float = 24.0
    stamp: float = 0.0


class Measurement(Protocol):
    """A measurement of one sensor: a frozen dataclass with its own stamp.

    The set of types is open: a body may bring its own (stack/telemetry/record_types.py).
    """

    @property
    def stamp(self) -> float:
        """Seconds on the body's clock."""


M = TypeVar("M", bound=Measurement)


@dataclass(frozen=True, slots=True)
class Observation:
    """The measurements since the last step, by sensor name; the newest one of each sensor.

    The names are those of the robot's description; `wheels`, `imu`, `camera` and `battery` are
    fixed. A sensor without a new measurement is not contained.

    Attributes:
        time: seconds on the body's clock.
        measurements: sensor name -> measurement. An IMU's contains all samples since the last one.
    """

    time: float
    measurements: Mapping[str, Measurement]

    def of(self, kind: type[M]) -> dict[str, M]:
        """Return the measurements of a type, by sensor name."""
        return {
            name: measurement
            for name, measurement in self.measurements.items()
            if isinstance(measurement, kind)
        }

    @property
    def wheels(self) -> Odometry | None:
        """Wheel odometry."""
        return self.named("wheels", Odometry)

    @property
    def imu(self) -> Imu | None:
        """The new samples of the inertial sensor."""
        return self.named("imu", Imu)

    @property
    def battery(self) -> Battery | None:
        """State of charge."""
        return self.named("battery", Battery)

    def named(self, name: str, kind: type[M]) -> M | None:
        """Return the measurement of a sensor; None without a new one of this type."""
        measurement = self.measurements.get(name)
        return measurement if isinstance(measurement, kind) else None
