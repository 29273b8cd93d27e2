"""Recording of a drive: what wheels, gyro and lidars measured, as arrays."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from missions.commissioning.reference import Reference, with_calibrated_gyro
from stack.drivetrain.description import RobotDescription
from stack.errors import InputError
from stack.localisation.fusion.wheels_gyro import WheelGyroOdometry
from stack.localisation.parameters import OdometryFusionParameters
from stack.types import FloatArray, Observation, Pose2D


@dataclass(frozen=True, slots=True)
class Track:
    """Poses by their stamps; headings do not jump.

    Attributes:
        stamps: (n,) seconds, increasing.
        poses: (n, 3) x, y, heading.
    """

    stamps: FloatArray
    poses: FloatArray

    def at(self, stamps: FloatArray) -> FloatArray:
        """Return (m, 3) the poses at some stamps, interpolated."""
        return np.column_stack([np.interp(stamps, self.stamps, axis) for axis in self.poses.T])


@dataclass(frozen=True, slots=True)
class Drive:
    """A recorded drive.

    Attributes:
        robot: as described during the drive.
        wheels: poses by the wheels, odom frame.
        gyro: (n, 2) stamp and integral of the yaw rate as measured, radians; empty without gyro.
        reference: poses of the base by a lidar.
    """

    robot: RobotDescription
    wheels: Track
    gyro: FloatArray
    reference: Track


def read_drive(
    observations: Iterable[Observation], robot: RobotDescription, lidar: str = ""
) -> Drive:
    """Return the drive that observations recorded.

    Args:
        observations: in order, as measured.
        robot: its description.
        lidar: whose scans are the reference; empty: the main one.

    Raises:
        InputError: wheels or lidar measured nothing, or the scans do not match.
    """
    name = lidar or robot.main_lidar
    if not name:
        raise InputError(f"{robot.name} has no lidar, which is the reference of a calibration")
    seen = list(observations)
    reference = _reference(seen, robot, name)
    return Drive(robot, wheels_of(seen), gyro_of(seen), reference)


def wheels_of(observations: Iterable[Observation]) -> Track:
    """Return the poses by the wheels.

    Raises:
        InputError: there are none.
    """
    readings = {o.wheels.stamp: o.wheels.pose for o in observations if o.wheels is not None}
    if len(readings) < 2:
        raise InputError("the drive has no odometry of the wheels")
    return _track(list(readings.items()))


def gyro_of(observations: Iterable[Observation]) -> FloatArray:
    """Return (n, 2) stamp and trapezoidal integral of the yaw rate, radians."""
    parts = [o.imu for o in observations if o.imu is not None and len(o.imu.stamps)]
    if not parts:
        return np.zeros((0, 2))
    stamps = np.concatenate([imu.stamps for imu in parts])
    rates = np.concatenate([imu.angular_velocity[:, 2] for imu in parts])
    stamps, first = np.unique(stamps, return_index=True)
    rates = rates[first]
    steps = 0.5 * (rates[1:] + rates[:-1]) * np.diff(stamps)
    return np.column_stack([stamps, np.concatenate([[0.0], np.cumsum(steps)])])


def fused_of(observations: Iterable[Observation], robot: RobotDescription) -> Track:
    """Return the poses by wheels and gyro, odom frame.

    Raises:
        InputError: there are none.
    """
    odometry, found = WheelGyroOdometry(OdometryFusionParameters(), robot), []
    for observation in observations:
        if observation.wheels is not None:
            fused = odometry.update(with_calibrated_gyro(observation, robot))
            found.append((fused.stamp, fused.pose))
    if len(found) < 2:
        raise InputError("the drive has no odometry of the wheels")
    return _track(found)


def _reference(seen: list[Observation], robot: RobotDescription, lidar: str) -> Track:
    """Return the poses by a lidar."""
    reference = Reference(robot, lidar)
    for observation in seen:
        reference.update(observation)
    return reference_track(reference, lidar)


def reference_track(reference: Reference, lidar: str) -> Track:
    """Return the trajectory of a reference.

    Raises:
        InputError: fewer than two scans have matched.
    """
    if len(reference.trajectory) < 2:
        raise InputError(
            f"the scans of {lidar} do not match each other",
            "drive where walls or furniture are within its range",
        )
    return _track(reference.trajectory)


def _track(poses: list[tuple[float, Pose2D]]) -> Track:
    rows = np.array([(pose.x, pose.y, pose.heading) for _, pose in poses])
    rows[:, 2] = np.unwrap(rows[:, 2])
    return Track(np.array([stamp for stamp, _ in poses]), rows)
