"""Lidar with a blind sector."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan, pi

import numpy as np

from stack.parameters import parameter
from stack.sim.faults.sensor_faults import SensorFault
from stack.types import Scan


@dataclass(frozen=True)
class SectorParameters:
    """Parameters of `LidarSector`."""

    middle: float = parameter(
        0.0, "rad", at_least=-2.0 * pi, at_most=2.0 * pi,
        help="direction of the middle of the sector, sensor frame", public=True,
    )  # fmt: skip
    width: float = parameter(
        pi / 3.0, "rad", above=0.0, at_most=2.0 * pi, help="width of the sector", public=True
    )
    shows: str = parameter(
        "invalid", one_of=("invalid", "nothing"),
        help="what its beams say: invalid, as of something on the housing, or no return",
    )  # fmt: skip
    sensor: str = parameter("lidar", help="name of the lidar")


class LidarSector(SensorFault):
    """A lidar sees nothing in a sector: a label or dirt on its housing."""

    Parameters = SectorParameters

    def changed(self, measurement: Scan) -> Scan:
        """Return the scan without the sector."""
        p = self.parameters
        apart = (measurement.angles - p.middle + pi) % (2.0 * pi) - pi
        said = np.float32(nan if p.shows == "invalid" else inf)
        ranges = np.where(np.abs(apart) <= p.width / 2.0, said, measurement.ranges)
        return measurement.with_ranges(ranges.astype(np.float32))
