"""Lidar whose ranges are too long or too short."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np

from stack.parameters import parameter
from stack.sim.faults.sensor_faults import SensorFault
from stack.types import Scan


@dataclass(frozen=True)
class BiasParameters:
    """Parameters of `LidarBias`."""

    bias: float = parameter(
        0.05, "m", at_least=-1.0, at_most=1.0, help="added to each range", public=True
    )
    sensor: str = parameter("lidar", help="name of the lidar")


class LidarBias(SensorFault):
    """All ranges of a lidar are too long, or too short: a wrong calibration, a warm sensor."""

    Parameters = BiasParameters

    def changed(self, measurement: Scan) -> Scan:
        """Return the scan with other ranges."""
        ranges = measurement.ranges + np.float32(self.parameters.bias)
        ranges = np.where(ranges > measurement.range_max, np.float32(inf), ranges)
        ranges = np.where(ranges < measurement.range_min, np.float32(nan), ranges)
        return measurement.with_ranges(ranges.astype(np.float32))
