"""Speed limits by place: zones and masks with a highest speed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2, cos, hypot, inf, sin
from pathlib import Path
from typing import Any

import numpy as np

from stack.costmap.zones import Zone, located_mask, read_mask, read_zones
from stack.geometry.polygons import points_inside
from stack.parameters import parameter
from stack.types import STANDSTILL, FloatArray, OccupancyGrid, Pose2D, Twist

_LOOKUP_STEP = 0.1
"""Metres between the points ahead at which limits are looked up."""

_STANDING_SPEED = 0.02
"""m/s below which the direction of the measured velocity is mostly noise."""


@dataclass(frozen=True)
class SpeedZone(Zone):
    """A polygon with a speed limit."""

    speed: float = parameter(0.3, "m/s", above=0.0, help="speed limit inside the zone")


@dataclass(frozen=True)
class SpeedLimitParameters:
    """Position and speed limit of zones; they limit the robot and add no cost."""

    zones: tuple[Any, ...] = parameter(
        (), public=True,
        help="polygons: {corners: [[x, y], …], speed: 0.3 m/s, name: text}, map frame",
    )  # fmt: skip
    mask: str = parameter(
        "", public=True,
        help="a map.yaml, relative to the mission; cells 1 to 100: percent of full_speed",
    )  # fmt: skip
    full_speed: float = parameter(
        1.0, "m/s", above=0.0, public=True, help="speed limit of mask value 100"
    )
    look_ahead: float = parameter(
        3.0, "m", at_least=0.0, help="distance ahead in which zones are checked"
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "zones", read_zones(SpeedZone, self.zones))

    def located(self, folder: Path) -> SpeedLimitParameters:
        """Return a copy whose mask file is resolved relative to a folder.

        Raises:
            InputError: the mask file does not exist.
        """
        if not self.mask:
            return self
        return replace(self, mask=located_mask(self.mask, folder, "speed_limits"))


class SpeedLimits:
    """Speed limits by place. The safety stage applies them; a costmap does not contain them.

    The robot is at the limit when its base enters a zone: it brakes in time, with its deceleration,
    for zones straight on in its direction of motion.

    Raises:
        InputError: the mask cannot be read.
    """

    def __init__(self, parameters: SpeedLimitParameters) -> None:
        self._parameters, self._mask = parameters, read_mask(parameters.mask)

    def at_points(self, points: FloatArray) -> FloatArray:
        """Return the (n,) speed limits in m/s at points (n, 2), metres, map frame; inf if none."""
        limits = np.full(len(points), inf)
        for zone in self._parameters.zones:
            found = points_inside(points, zone.points)
            limits[found] = np.minimum(limits[found], zone.speed)
        if self._mask is not None:
            limits = np.minimum(limits, self._masked(self._mask, points))
        return limits

    def at_pose(self, pose: Pose2D, deceleration: float, twist: Twist = STANDSTILL) -> float:
        """Highest speed that still allows braking to the limit of every zone in the way, m/s.

        The minimum over look_ahead of v² = v_zone² + 2 · deceleration · distance; inf without
        zones.

        Args:
            pose: of the base, map frame.
            deceleration: of the robot, m/s².
            twist: measured; a robot that stands is expected to drive along its heading.
        """
        if not self._parameters.zones and self._mask is None:
            return inf
        distances = np.arange(0.0, self._parameters.look_ahead + 1e-9, _LOOKUP_STEP)
        moves = hypot(twist.linear, twist.lateral) >= _STANDING_SPEED
        direction = atan2(twist.lateral, twist.linear) if moves else 0.0
        ahead = pose.transform(np.outer(distances, (cos(direction), sin(direction))))
        squared = self.at_points(ahead) ** 2 + 2.0 * deceleration * distances
        return float(np.sqrt(squared.min()))

    def _masked(self, mask: OccupancyGrid, points: FloatArray) -> FloatArray:
        cells = np.floor((points - mask.origin) / mask.resolution).astype(int)
        rows, columns = mask.cells.shape
        limits = np.full(len(points), inf)
        on_mask = (cells >= 0).all(axis=1) & (cells < (columns, rows)).all(axis=1)
        percent = mask.cells[cells[on_mask, 1], cells[on_mask, 0]].astype(np.float64)
        speeds = percent / 100.0 * self._parameters.full_speed
        limits[on_mask] = np.where((percent >= 1) & (percent <= 100), speeds, inf)
        return limits
