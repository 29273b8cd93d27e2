"""Gyro with a bias."""

from __future__ import annotations

from dataclasses import dataclass, replace

from stack.drivetrain.description import RobotDescription
from stack.parameters import parameter
from stack.sim.faults.fault import Fault, Measurements
from stack.sim.worlds.world import World
from stack.types import Imu


@dataclass(frozen=True)
class GyroParameters:
    """Parameters of `GyroBias`."""

    bias: float = parameter(
        0.05, "rad/s", at_least=-2.0, at_most=2.0, help="added to the yaw rate", public=True
    )


class GyroBias(Fault):
    """The gyro measures a yaw rate that is not there: temperature, a knock."""

    Parameters = GyroParameters

    @classmethod
    def lack(cls, parameters: GyroParameters, robot: RobotDescription, world: World) -> str:
        """Return that the robot has no gyro."""
        return "" if robot.imu is not None else f"{robot.name} has no imu"

    def measured(self, measurements: Measurements, time: float) -> Measurements:
        """Return the measurements with other samples of the gyro."""
        samples = measurements.get("imu")
        if not isinstance(samples, Imu):
            return measurements
        rates = samples.angular_velocity.copy()
        rates[:, 2] += self.parameters.bias
        return {**measurements, "imu": replace(samples, angular_velocity=rates)}
