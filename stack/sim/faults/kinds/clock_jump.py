"""Sensor whose clock jumps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from stack.parameters import parameter
from stack.sim.faults.sensor_faults import ANY, SensorFault
from stack.types import Imu, Measurement


@dataclass(frozen=True)
class JumpParameters:
    """Parameters of `ClockJump`."""

    by: float = parameter(
        -0.5, "s", at_least=-60.0, at_most=60.0, help="added to its stamps", public=True
    )
    sensor: str = parameter("lidar", help="name of a lidar, sonar or camera, or imu")


class ClockJump(SensorFault):
    """The clock of a sensor jumps: its measurements have wrong stamps."""

    Parameters = JumpParameters
    what = ANY

    def changed(self, measurement: Any) -> Measurement:
        """Return the measurement with other stamps."""
        by = self.parameters.by
        if isinstance(measurement, Imu):
            return replace(measurement, stamps=measurement.stamps + by)
        moved: Measurement = replace(measurement, stamp=measurement.stamp + by)
        return moved
