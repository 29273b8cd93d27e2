"""Lidar that repeats its last scan."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from stack.parameters import parameter
from stack.sim.faults.sensor_faults import SensorFault
from stack.types import Scan


@dataclass(frozen=True)
class FrozenParameters:
    """Parameters of `LidarFrozen`."""

    sensor: str = parameter("lidar", help="name of the lidar")


class LidarFrozen(SensorFault):
    """A lidar repeats one scan with new stamps: its driver or firmware hangs."""

    Parameters = FrozenParameters

    def __init__(self, parameters: FrozenParameters, random: np.random.Generator) -> None:
        super().__init__(parameters, random)
        self._scan: Scan | None = None

    def changed(self, measurement: Scan) -> Scan:
        """Return the first scan of the fault with the stamp of this one."""
        self._scan = self._scan or measurement
        return replace(self._scan, stamp=measurement.stamp)
