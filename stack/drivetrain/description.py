"""Description of a robot: footprint, limits, wheels and sensors, as read from robot.yaml."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import atan, cos, hypot, inf, pi, sin
from pathlib import Path as FilePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.drivetrain.arm_description import ArmDescription
from stack.drivetrain.drivetrain import Drivetrain, WheelGeometry
from stack.drivetrain.limits import Limits
from stack.drivetrain.skid_steered import Skid
from stack.drivetrain.wheel_loop import NO_GAINS, WheelGains
from stack.errors import Finding
from stack.parameters import parameter
from stack.types import CameraModel, FloatArray, Footprint, Imu, LinkJoint, Pose2D

COLUMNS_OF_A_BEAM = 2
"""Columns of a depth picture in a beam of its virtual scan."""

TOUCH = 1e-6
"""Radians between masks that touch: an end in degrees is not exact in radians."""

BASE = "base"
"""Name of the base frame."""

CAMERA = "camera"
"""Name of the colour camera."""

SCAN_SUFFIX = "_scan"
"""Added to the name of a depth camera for its virtual scan."""


@dataclass(frozen=True)
class OdometryNoise:
    """Errors of wheel odometry: those of the simulation, and those that estimators expect."""

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
        6.283185307179586, "rad", above=0.0, help="360 deg for a full turn"
    )
    rate: float = parameter(10.0, "Hz", above=0.0, help="scans per second")
    range_min: float = parameter(0.08, "m", at_least=0.0, help="shorter ranges are invalid")
    range_max: float = parameter(12.0, "m", above=0.0, help="longer ranges are no return")
    noise: float = parameter(0.01, "m", at_least=0.0, help="standard deviation of a range")
    dropout: float = parameter(0.005, at_least=0.0, at_most=1.0, help="share of beams lost")
    rotation_time: float = parameter(
        0.0,
        "s",
        at_least=0.0,
        at_most=1.0,
        help="time of a full turn; 0: all beams are measured at one instant",
    )
    mask: tuple[tuple[float, float], ...] = ()
    """Directions in which it sees the robot: (from, to) anticlockwise seen from above, in its
    planar frame, radians. Beams between them are invalid."""
    upside_down: bool = False
    """Whether the angles of the sensor itself run the other way; scans and mask do not."""

    @property
    def angle_min(self) -> float:
        """Direction of beam 0 in the sensor frame, radians."""
        return -min(self.field_of_view, 2.0 * pi) / 2.0

    @property
    def angle_increment(self) -> float:
        """Angle from beam to beam, radians; the beams of a full turn do not meet."""
        turn = min(self.field_of_view, 2.0 * pi)
        return turn / self.beams if turn > 2.0 * pi - 1e-6 else turn / (self.beams - 1)

    @property
    def angles(self) -> FloatArray:
        """(beams,) directions in the sensor frame, radians."""
        beams = np.arange(self.beams, dtype=np.float64)
        return self.angle_min + self.angle_increment * beams

    def masks(self, angles: FloatArray, least: float = 0.0) -> NDArray[np.bool_]:
        """Return which directions (n,) are masked, by masks wider than `least`, radians.

        Masks that touch are one.
        """
        masked = np.zeros(angles.shape, dtype=bool)
        for first, width in _joined(self.mask):
            if width > least:
                masked |= (angles - first) % (2.0 * pi) <= width
        return masked


def _joined(mask: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """Return the first direction and the width of masks, those that touch as one, radians."""
    found: list[tuple[float, float]] = []
    for first, last in mask:
        width = (last - first) % (2.0 * pi)
        for other in list(found):
            before, after = (first - other[0]) % (2.0 * pi), (other[0] - first) % (2.0 * pi)
            if before <= other[1] + TOUCH:
                first, width = other[0], max(other[1], before + width)
            elif after <= width + TOUCH:
                width = max(width, after + other[1])
            else:
                continue
            found.remove(other)
        found.append((first, min(width, 2.0 * pi)))
    return found


@dataclass(frozen=True)
class SonarDescription:
    """A sonar: measures the distance to the nearest obstacle in a cone."""

    mount: Pose2D
    height: float = parameter(0.1, "m", above=0.0, help="above the floor")
    field_of_view: float = parameter(
        0.44, "rad", above=0.0, at_most=1.6, help="opening of the cone"
    )
    rate: float = parameter(10.0, "Hz", above=0.0, help="readings per second")
    range_min: float = parameter(0.05, "m", at_least=0.0, help="shorter distances are invalid")
    range_max: float = parameter(2.5, "m", above=0.0, help="longer distances are no return")
    noise: float = parameter(0.01, "m", at_least=0.0, help="standard deviation of a distance")


@dataclass(frozen=True)
class CameraDescription:
    """A colour camera; its mount is in the frame of a link, or in the base frame."""

    model: CameraModel
    rate: float = parameter(5.0, "Hz", above=0.0, help="pictures per second while requested")
    latency: float = parameter(0.1, "s", at_least=0.0, help="time from exposure to delivery")
    noise: float = parameter(2.0, at_least=0.0, help="standard deviation of a colour value, 0..255")
    range_max: float = parameter(12.0, "m", above=0.0, help="far limit of the rendering")
    exposure: float = parameter(
        0.0, "s", at_least=0.0, at_most=0.5,
        help="exposure time; pictures of a moving camera are blurred; 0: none",
    )  # fmt: skip
    max_gain: float = parameter(
        1.0, at_least=1.0, at_most=64.0,
        help="largest gain of the automatic exposure, its inverse is the smallest; 1: fixed",
    )  # fmt: skip
    renderer: str = parameter(
        "tiny", one_of=("tiny", "gl", "auto"),
        help="tiny: PyBullet's own; gl: OpenGL, several times as fast, needs treepilot[gl]; auto: "
        "gl where it works",
    )  # fmt: skip
    link: str = parameter(
        "", help="link of the URDF that carries it, which may be moved; default: the base"
    )


@dataclass(frozen=True)
class DepthScanDescription:
    """A virtual scan: what a depth camera sees between two heights, as a planar lidar would."""

    low: float = parameter(0.08, "m", above=0.0, help="lower edge of the band, above the floor")
    high: float = parameter(0.35, "m", above=0.0, help="upper edge of the band")
    least_pixels: int = parameter(
        2, at_least=1, help="pixels of a beam that must see something at a range or nearer"
    )


@dataclass(frozen=True)
class DepthCameraDescription:
    """A depth camera: stereo, structured light or time of flight; its mount is as a camera's."""

    model: CameraModel
    scan: DepthScanDescription | None = None
    rate: float = parameter(10.0, "Hz", above=0.0, help="pictures per second")
    latency: float = parameter(0.05, "s", at_least=0.0, help="time from exposure to delivery")
    noise: float = parameter(
        0.005, at_least=0.0,
        help="standard deviation at 1 m, metres; grows with the square of the distance",
    )  # fmt: skip
    dropout: float = parameter(
        0.01, at_least=0.0, at_most=1.0, help="share of the pixels without a return"
    )
    range_min: float = parameter(0.15, "m", above=0.0, help="shortest measured distance")
    range_max: float = parameter(4.0, "m", above=0.0, help="longest measured distance")
    renderer: str = parameter(
        "tiny", one_of=("tiny", "gl", "auto"),
        help="tiny: PyBullet's own; gl: OpenGL, several times as fast, needs treepilot[gl]; auto: "
        "gl where it works",
    )  # fmt: skip
    link: str = parameter(
        "", help="link of the URDF that carries it, which may be moved; default: the base"
    )


@dataclass(frozen=True)
class ImuDescription:
    """A six-axis inertial sensor at the base frame's origin."""

    rate: float = parameter(100.0, "Hz", above=0.0, help="samples per second")
    gyro_noise: float = parameter(
        0.004, "rad/s", at_least=0.0, help="standard deviation per sample"
    )
    gyro_bias: float = parameter(0.01, "rad/s", at_least=0.0, help="standard deviation of the bias")
    accelerometer_noise: float = parameter(
        0.05, "m/s²", at_least=0.0, help="standard deviation per sample"
    )
    accelerometer_bias: float = parameter(
        0.05, "m/s²", at_least=0.0, help="standard deviation of the bias"
    )
    gyro_scale_error: float = parameter(
        0.0, at_least=0.0, at_most=0.1, help="standard deviation of the relative error of its scale"
    )
    gyro_scale: float = parameter(
        1.0, at_least=0.5, at_most=2.0, help="true yaw rate divided by the measured one, calibrated"
    )
    gyro_offset: float = parameter(
        0.0, "rad/s", at_least=-0.5, at_most=0.5, help="measured yaw rate at rest, calibrated"
    )

    def corrected(self, measured: Imu) -> Imu:
        """Return samples with the calibrated yaw rate."""
        rates = measured.angular_velocity.copy()
        rates[:, 2] = self.gyro_scale * (rates[:, 2] - self.gyro_offset)
        return replace(measured, angular_velocity=rates)


@dataclass(frozen=True)
class BatteryDescription:
    """A battery: drains at rest and in motion, charges on a dock."""

    capacity: float = parameter(100.0, "Wh", above=0.0, help="energy when full")
    idle_power: float = parameter(15.0, "W", at_least=0.0, help="power drawn at rest")
    drive_power: float = parameter(60.0, "W", at_least=0.0, help="additional power at top speed")
    charge_power: float = parameter(200.0, "W", above=0.0, help="charging power on a dock")
    voltage_full: float = parameter(25.2, "V", above=0.0, help="voltage when full")
    voltage_empty: float = parameter(20.0, "V", above=0.0, help="voltage when empty")

    def charge_at(self, voltage: float) -> float:
        """Return the charge in [0, 1] at a voltage, which is linear in the charge."""
        span = self.voltage_full - self.voltage_empty
        return min(max((voltage - self.voltage_empty) / span, 0.0), 1.0)


@dataclass(frozen=True)
class RobotDescription:
    """Description of a robot.

    Attributes:
        name: e.g. scout.
        footprint: outline in the base frame.
        height: metres; obstacles above it do not block the robot.
        urdf: file with shapes and masses, from which `model` was made.
        wheels: geometry and URDF joints of the wheels; `NoWheels` if the base is fixed.
        limits: of speed and acceleration.
        odometry: errors of the wheel odometry.
        skid: sliding of the wheels in turns; for skid-steered drives only.
        wheel_control: gains for wheels that are driven by efforts, in the simulation newton metres.
        lidar: the lidar called `lidar`; None without one.
        components: component choices and parameters of this robot, as raw values by kind
            ({"controller": {"use": "pure_pursuit", "cruise_speed": 0.5}}); those of the mission
            take precedence.
        source: the robot.yaml.
        lidars: additional lidars by name.
        sonars: by name.
        depth_cameras: by name. One with a `scan` is a lidar as well, called NAME_scan.
        body: which body drives it unless the command line says otherwise.
        body_parameters: of that body, as raw values.
        sensor_drivers: of real sensors, by sensor name: name of the driver and raw parameters.
        model: the URDF that the simulation loads: its root is the base frame, its meshes are named
            by absolute paths.
        warnings: about the robot file and the URDF.
        arm: None without one.
        links: joints between the base frame, called BASE, and all links of the URDF; parents come
            before their children.
        actual: the robot that a simulation simulates, when it differs from this description, as a
            real robot does before it is calibrated; None: this one.
    """

    name: str
    footprint: Footprint
    height: float
    urdf: FilePath
    wheels: WheelGeometry
    limits: Limits = field(default_factory=Limits)
    odometry: OdometryNoise = field(default_factory=OdometryNoise)
    lidar: LidarDescription | None = None
    camera: CameraDescription | None = None
    imu: ImuDescription | None = None
    battery: BatteryDescription = field(default_factory=BatteryDescription)
    components: dict[str, Any] = field(default_factory=dict)
    source: FilePath | None = None
    lidars: Mapping[str, LidarDescription] = field(default_factory=dict)
    sonars: Mapping[str, SonarDescription] = field(default_factory=dict)
    body: str = "simulated"
    skid: Skid = field(default_factory=Skid)
    depth_cameras: Mapping[str, DepthCameraDescription] = field(default_factory=dict)
    model: str = ""
    warnings: tuple[Finding, ...] = ()
    body_parameters: Mapping[str, Any] = field(default_factory=dict)
    sensor_drivers: Mapping[str, tuple[str, Mapping[str, Any]]] = field(default_factory=dict)
    actual: RobotDescription | None = None
    wheel_control: WheelGains = NO_GAINS
    arm: ArmDescription | None = None
    links: tuple[LinkJoint, ...] = field(default=(), repr=False)

    def drawn_by(self, renderer: str) -> RobotDescription:
        """Return the robot with this renderer for all simulated cameras: tiny, gl or auto."""
        camera = None if self.camera is None else replace(self.camera, renderer=renderer)
        depth = {name: replace(it, renderer=renderer) for name, it in self.depth_cameras.items()}
        return replace(self, camera=camera, depth_cameras=depth)

    @property
    def real_lidars(self) -> dict[str, LidarDescription]:
        """Every lidar that the body has, by sensor name."""
        main = {} if self.lidar is None else {"lidar": self.lidar}
        return {**main, **self.lidars}

    @property
    def all_lidars(self) -> dict[str, LidarDescription]:
        """Every lidar by sensor name, and the virtual scans of depth cameras after them.

        Localisation and tracker use the first one.
        """
        return {**self.real_lidars, **self.depth_scans}

    @cached_property
    def depth_scans(self) -> dict[str, LidarDescription]:
        """The virtual scans of the depth cameras, by sensor name: `depth_scan` of `depth`."""
        return {
            f"{name}{SCAN_SUFFIX}": lidar_of(camera, camera.scan)
            for name, camera in self.depth_cameras.items()
            if camera.scan is not None
        }

    def delivers_pictures(self, sensor: str) -> bool:
        """Return whether a range sensor is a depth camera, or a virtual scan of one."""
        return sensor in self.depth_cameras or sensor in self.depth_scans

    def word_for_measurement(self, sensor: str) -> str:
        """Return what a range sensor delivers, for messages: scan, reading or picture."""
        if sensor in self.depth_cameras:
            return "picture"
        return "reading" if sensor in self.sonars else "scan"

    def range_noise(self, lidar: str = "") -> float:
        """Return the standard deviation of a range of a lidar, metres; empty: the main one.

        That of a usual lidar for a robot without any.
        """
        described = self.all_lidars.get(lidar or self.main_lidar)
        return LidarDescription.noise if described is None else described.noise

    @property
    def main_lidar(self) -> str:
        """Name of the first lidar, which localisation and tracker use; empty without one."""
        return next(iter(self.all_lidars), "")

    @cached_property
    def drivetrain(self) -> Drivetrain:
        """Kinematics of the drive and what it can do."""
        return self.wheels.drivetrain(self.limits)

    @property
    def turn_deviation(self) -> float:
        """Relative standard deviation of turns by the wheels besides slip: those that slide."""
        skid = self.skid
        sliding = skid.slip * hypot(skid.floor_variation, skid.variation)
        return sliding if self.drivetrain.skids else 0.0

    @property
    def turning_radius(self) -> float:
        """Radius of the tightest circle, metres; 0 if the robot can turn in place."""
        return self.drivetrain.turning_radius


def lidar_of(camera: DepthCameraDescription, scan: DepthScanDescription) -> LidarDescription:
    """Return the lidar that a virtual scan stands for.

    Its range ends where the picture no longer shows the lower edge of the band, and begins where it
    shows the upper one; its field of view is that of all rows of the picture, and its noise that of
    the camera at half of the range.

    Args:
        camera: with its mount.
        scan: with its band.
    """
    model = camera.model
    x, y, height = model.position
    sine, cosine = sin(model.pitch), cos(model.pitch)
    up = (model.height / 2 - 0.5) / model.focal_length
    rises = {"top": up * cosine - sine, "bottom": -up * cosine - sine}
    ahead = {"top": cosine + up * sine, "bottom": cosine - up * sine}
    farthest = _crossing(height - scan.low, rises["top"], ahead["top"])
    nearest = _crossing(height - scan.high, rises["bottom"], ahead["bottom"])
    longest = min(camera.range_max, farthest)
    aside = (model.width / 2 - 0.5) / model.focal_length
    return LidarDescription(
        Pose2D(x, y, model.yaw), height=height, beams=max(3, model.width // COLUMNS_OF_A_BEAM),
        field_of_view=2.0 * atan(aside / max(ahead.values())), rate=camera.rate,
        range_min=max(camera.range_min, 0.0 if nearest == inf else nearest),
        range_max=longest, noise=camera.noise * (0.5 * longest) ** 2, dropout=0.0,
    )  # fmt: skip


def _crossing(drop: float, rise: float, ahead: float) -> float:
    """Return the distance in the plane at which a ray has fallen by `drop`; inf if it never has.

    It is 0 for a ray that begins lower.
    """
    if drop <= 0.0:
        return 0.0
    return inf if rise >= 0.0 else ahead * drop / -rise
