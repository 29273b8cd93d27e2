"""Depth pictures with holes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import ceil, nan

import numpy as np

from stack.parameters import parameter
from stack.sim.faults.sensor_faults import DEPTH, SensorFault
from stack.types import DepthImage


@dataclass(frozen=True)
class HolesParameters:
    """Parameters of `DepthHoles`."""

    share: float = parameter(
        0.3, at_least=0.0, at_most=1.0, help="share of the picture in holes", public=True
    )
    size: int = parameter(16, at_least=1, at_most=512, help="side of a hole, pixels")
    sensor: str = parameter("depth", help="name of the depth camera")


class DepthHoles(SensorFault):
    """Square holes in the pictures of a depth camera, elsewhere in each: sunlight, gloss, glass."""

    Parameters = HolesParameters
    what = DEPTH

    def changed(self, measurement: DepthImage) -> DepthImage:
        """Return the picture with holes, on a grid of their size."""
        p, (height, width) = self.parameters, measurement.depth.shape
        tiles = self.random.random((ceil(height / p.size), ceil(width / p.size))) < p.share
        holes = np.kron(tiles, np.ones((p.size, p.size), dtype=bool))[:height, :width]
        return replace(measurement, depth=np.where(holes, np.float32(nan), measurement.depth))
