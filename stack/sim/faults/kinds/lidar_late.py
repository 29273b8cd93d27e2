"""Lidar whose scans arrive late."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np

from stack.parameters import parameter
from stack.sim.faults.fault import Measurements
from stack.sim.faults.sensor_faults import SensorFault
from stack.types import Measurement

ROUNDING = 1e-9
"""Seconds by which two times that are meant to be the same may differ."""


@dataclass(frozen=True)
class LateParameters:
    """Parameters of `LidarLate`."""

    delay: float = parameter(
        0.3, "s", above=0.0, at_most=10.0, help="by which scans arrive later", public=True
    )
    sensor: str = parameter("lidar", help="name of the lidar")


class LidarLate(SensorFault):
    """The scans of a lidar arrive late, with true stamps: a busy computer or network."""

    Parameters = LateParameters

    def __init__(self, parameters: LateParameters, random: np.random.Generator) -> None:
        super().__init__(parameters, random)
        self._waiting: deque[tuple[float, Measurement]] = deque()

    def measured(self, measurements: Measurements, time: float) -> Measurements:
        """Return the measurements with the newest scan that has arrived by now."""
        rest = dict(measurements)
        scan = rest.pop(self.parameters.sensor, None)
        if scan is not None:
            self._waiting.append((time + self.parameters.delay, scan))
        while self._waiting and self._waiting[0][0] <= time + ROUNDING:
            rest[self.parameters.sensor] = self._waiting.popleft()[1]
        return rest
