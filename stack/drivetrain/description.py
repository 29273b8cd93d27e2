"""What a robot is: outline, limits, wheels and sensors, as read from its robot.yaml."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from math import cos, sin, tan
from pathlib import Path as FilePath
from typing import Any

import numpy as np

from stack.parameters import parameter
from stack.types import CameraModel, FloatArray, Footprint, Pose2D


class DriveKind(StrEnum):
    """Which velocities a drive can make."""

    DIFFERENTIAL = "differential"
    OMNI = "omni"
    ACKERMANN = "ackermann"


@dataclass(frozen=True)
class Limits:
    """What the drive can do."""

    linear_speed: float = parameter(0.8, "m/s", above=0.0, help="top speed forward")
    reverse_speed: float = parameter(0.3, "m/s", at_least=0.0, help="top speed backward")
    lateral_speed: float = parameter(
        0.0, "m/s", at_least=0.0, help="top speed sideways; omnidirectional robots only"
    )
    angular_speed: float = parameter(1.8, "rad/s", above=0.0, help="top turning speed")
    linear_acceleration: float = parameter(1.0, "m/s²", above=0.0, help="speeding up")
    linear_deceleration: float = parameter(1.5, "m/s²", above=0.0, help="slowing down")
    angular_acceleration: float = parameter(3.2, "rad/s²", above=0.0, help="turning, both ways")


@dataclass(frozen=True)
class Wheels:
    """A differential drive: names of the URDF joints and the geometry behind the odometry."""

    left: tuple[str, ...]
    right: tuple[str, ...]
    radius: float
    separation: float


@dataclass(frozen=True)
class OmniWheels:
    """Three or more wheels that each push one way and roll freely the other.

    Attributes:
        joints: of the URDF, one a wheel.
        mounts: where each touches the floor, base frame; the heading is the way that it pushes.
        radius: metres.
    """

    joints: tuple[str, ...]
    mounts: tuple[Pose2D, ...]
    radius: float

    @property
    def jacobian(self) -> FloatArray:
        """(n, 3): the speed that each wheel rolls at, m/s, for each of linear, lateral, angular."""
        return np.array([
            [cos(m.heading), sin(m.heading), m.x * sin(m.heading) - m.y * cos(m.heading)]
            for m in self.mounts
        ])  # fmt: skip


@dataclass(frozen=True)
class SteeredWheels:
    """A car: steered front wheels, driven rear wheels; the base frame lies midway between these.

    Attributes:
        steering: URDF joints that turn the front wheels, left and right.
        rear: URDF joints of the driven wheels, left and right.
        radius: of the rear wheels, metres.
        wheelbase: from axle to axle, metres.
        track: between left and right wheels, metres.
        steering_angle: the most that the middle of the front axle steers, radians.
        steering_speed: how fast it steers, rad/s.
    """

    steering: tuple[str, str]
    rear: tuple[str, str]
    radius: float
    wheelbase: float
    track: float
    steering_angle: float
    steering_speed: float

    @property
    def turning_radius(self) -> float:
        """Tightest circle that the base frame's origin can drive, metres."""
        return self.wheelbase / tan(self.steering_angle)


@dataclass(frozen=True)
class OdometryNoise:
    """How wheel odometry errs. All draws are seeded."""

    scale_error: float = parameter(
        0.01, at_least=0.0, at_most=0.2, help="standard deviation of each wheel's fixed scale error"
    )
    slip: float = parameter(
        0.02,
        at_least=0.0,
        at_most=0.5,
        help="standard deviation of a wheel's slip, per metre rolled",
    )
    ticks_per_turn: int = parameter(2048, at_least=16, help="encoder resolution")


@dataclass(frozen=True)
class LidarDescription:
    """A planar lidar."""

    mount: Pose2D
    height: float = parameter(0.2, "m", above=0.0, help="above the floor")
    beams: int = parameter(360, at_least=3, at_most=4096, help="beams per turn")
    field_of_view: float = parameter(
        6.283185307179586, "rad", above=0.0, help="360 deg is all round"
    )
    rate: float = parameter(10.0, "Hz", above=0.0, help="scans per second")
    range_min: float = parameter(0.08, "m", at_least=0.0, help="nearer is invalid")
    range_max: float = parameter(12.0, "m", above=0.0, help="farther is no return")
    noise: float = parameter(0.01, "m", at_least=0.0, help="standard deviation of a range")
    dropout: float = parameter(0.005, at_least=0.0, at_most=1.0, help="share of beams lost")


@dataclass(frozen=True)
class SonarDescription:
    """A sonar: hears the nearest thing somewhere in a cone."""

    mount: Pose2D
    height: float = parameter(0.1, "m", above=0.0, help="above the floor")
    field_of_view: float = parameter(
        0.44, "rad", above=0.0, at_most=1.6, help="opening of the cone"
    )
    rate: float = parameter(10.0, "Hz", above=0.0, help="readings per second")
    range_min: float = parameter(0.05, "m", at_least=0.0, help="nearer is invalid")
    range_max: float = parameter(2.5, "m", above=0.0, help="farther is no return")
    noise: float = parameter(0.01, "m", at_least=0.0, help="standard deviation of a distance")


@dataclass(frozen=True)
class CameraDescription:
    """A colour camera."""

    model: CameraModel
    rate: float = parameter(5.0, "Hz", above=0.0, help="pictures per second while asked for")
    latency: float = parameter(0.1, "s", at_least=0.0, help="exposure to delivery")
    noise: float = parameter(2.0, at_least=0.0, help="standard deviation of a colour value, 0..255")
    range_max: float = parameter(12.0, "m", above=0.0, help="nothing is drawn beyond")


@dataclass(frozen=True)
class ImuDescription:
    """A six-axis inertial sensor at the base frame's origin."""

    rate: float = parameter(100.0, "Hz", above=0.0, help="samples per second")
    gyro_noise: float = parameter(
        0.004, "rad/s", at_least=0.0, help="standard deviation per sample"
    )
    gyro_bias: float = parameter(0.01, "rad/s", at_least=0.0, help="standard deviation of the bias")
    accelerometer_noise: float = parameter(0.05, "m/s²", at_least=0.0, help="per sample")
    accelerometer_bias: float = parameter(0.05, "m/s²", at_least=0.0, help="of the bias")


@dataclass(frozen=True)
class BatteryDescription:
    """A battery that drains at rest and with motion and charges on a dock."""

    capacity: float = parameter(100.0, "Wh", above=0.0, help="energy when full")
    idle_power: float = parameter(15.0, "W", at_least=0.0, help="drawn at rest")
    drive_power: float = parameter(60.0, "W", at_least=0.0, help="drawn more at top speed")
    charge_power: float = parameter(200.0, "W", above=0.0, help="taken in on the dock")
    voltage_full: float = parameter(25.2, "V", above=0.0, help="when full")
    voltage_empty: float = parameter(20.0, "V", above=0.0, help="when empty")


@dataclass(frozen=True)
class RobotDescription:
    """Everything about a robot that is not the world's.

    Attributes:
        name: e.g. scout.
        footprint: outline in the base frame.
        height: metres, for what passes over it.
        urdf: the file that shapes and masses come from.
        lidars: further ones by name; `lidar` alone localises.
        sonars: by name.
        navigation: component choices and parameters for this robot, as raw values by kind
            ({"controller": {"use": "pure_pursuit", "cruise_speed": 0.5}}), under the mission's.
    """

    name: str
    footprint: Footprint
    height: float
    urdf: FilePath
    wheels: Wheels | OmniWheels | SteeredWheels
    limits: Limits = field(default_factory=Limits)
    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    lidar: LidarDescription | None = None
    camera: CameraDescription | None = None
    imu: ImuDescription | None = None
    battery: BatteryDescription = field(default_factory=BatteryDescription)
    navigation: dict[str, Any] = field(default_factory=dict)
    source: FilePath | None = None
    lidars: Mapping[str, LidarDescription] = field(default_factory=dict)
    sonars: Mapping[str, SonarDescription] = field(default_factory=dict)

    @property
    def drive(self) -> DriveKind:
        """Which velocities it can make."""
        if isinstance(self.wheels, OmniWheels):
            return DriveKind.OMNI
        if isinstance(self.wheels, SteeredWheels):
            return DriveKind.ACKERMANN
        return DriveKind.DIFFERENTIAL

    @property
    def turning_radius(self) -> float:
        """Tightest circle it can drive, metres; 0 where it can turn in place."""
        return self.wheels.turning_radius if isinstance(self.wheels, SteeredWheels) else 0.0
