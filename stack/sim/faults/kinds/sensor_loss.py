"""Sensor that delivers nothing."""

from __future__ import annotations

from dataclasses import dataclass

from stack.parameters import parameter
from stack.sim.faults.fault import Target
from stack.sim.faults.sensor_faults import ANY, SensorFault


@dataclass(frozen=True)
class LossParameters:
    """Parameters of `SensorLoss`."""

    sensor: str = parameter(
        "lidar", help="name of a lidar, sonar, camera or depth camera, or imu", public=True
    )


class SensorLoss(SensorFault):
    """A sensor delivers nothing: no power, a cable, a crashed driver."""

    Parameters = LossParameters
    what = ANY

    def begin(self, target: Target) -> None:
        """Let it deliver nothing."""
        target.robot.silence(self.parameters.sensor, silent=True)

    def end(self, target: Target) -> None:
        """Let it work again."""
        target.robot.silence(self.parameters.sensor, silent=False)
