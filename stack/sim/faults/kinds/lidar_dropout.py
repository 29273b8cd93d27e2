"""Lidar beams that get lost."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np

from stack.parameters import parameter
from stack.sim.faults.sensor_faults import SensorFault
from stack.types import Scan


@dataclass(frozen=True)
class DropoutParameters:
    """Parameters of `LidarDropout`."""

    share: float = parameter(
        0.5, at_least=0.0, at_most=1.0, help="share of the beams without a return", public=True
    )
    sensor: str = parameter("lidar", help="name of the lidar")


class LidarDropout(SensorFault):
    """A share of the lidar's beams has no return, others in each scan: dust, black surfaces."""

    Parameters = DropoutParameters

    def changed(self, measurement: Scan) -> Scan:
        """Return the scan with beams lost."""
        lost = self.random.random(measurement.ranges.size) < self.parameters.share
        return measurement.with_ranges(
            np.where(lost, np.float32(inf), measurement.ranges).astype(np.float32)
        )
