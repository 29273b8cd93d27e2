"""Zone layers: keepout zones, preferred lanes and speed zones.

Each accepts polygons (`zones`), a mask (a ROS map.yaml whose occupied cells are the zone), or both.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf
from typing import Any, ClassVar

import numpy as np

from stack.costmap.layer import NO_BOX, Box, Canvas, Frame, Region, SensorUpdate, part
from stack.costmap.zones import Zone, ZoneCells, read_mask, read_zones
from stack.geometry.polygons import points_inside
from stack.parameters import parameter
from stack.types import LETHAL_COST, FloatArray, Footprint, OccupancyGrid, Pose2D


@dataclass(frozen=True)
class _Zoned:
    """Position of the zones."""

    zones: tuple[Any, ...] = parameter(
        (), help="polygons: [[x, y], …] or {name: text, corners: [[x, y], …]}, map frame"
    )
    mask: str = parameter(
        "", help="a map.yaml, relative to the mission; its occupied cells are the zone"
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "zones", read_zones(Zone, self.zones))


class KeepoutLayer:
    """Zones that the robot must not enter; their cells are lethal.

    Listed before `inflation`, the whole footprint stays outside; after it, only the centre.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Position of the keepout zones."""

    needs_tracks: ClassVar[bool] = False
    reach = 0

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        self._cells = ZoneCells(parameters.zones, read_mask(parameters.mask))

    def configure(self, parameters: Parameters) -> None:
        """Do nothing: zones are read once, when the layer is created."""

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Draw the zones in the new frame."""
        self._cells.lay_out(frame, shift)

    def update(self, senses: SensorUpdate) -> Box:
        """Change nothing: zones do not depend on sensors."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Paint cells inside a zone as lethal."""
        canvas.cells[part(self._cells.cells, canvas.box) > 0] = LETHAL_COST

    def clear(self, region: Region | None) -> Box:
        """Change nothing: zones stay."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The name of the zone, None outside."""
        name = self._cells.name_at(row, column)
        return None if name is None else (name, None)


class PreferredLanesLayer:
    """Preferred lanes: cells outside them have a minimum cost.

    List it after `inflation`. Use it in the global costmap (`only: global`): a controller that
    slows down at high costs would be slow everywhere outside the lanes.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Position of the lanes and the cost outside them."""

        cost_outside: int = parameter(
            60, at_least=1, at_most=252, help="minimum cost outside the lanes"
        )

    needs_tracks: ClassVar[bool] = False
    reach = 0

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        self._parameters = parameters
        self._cells = ZoneCells(parameters.zones, read_mask(parameters.mask))

    def configure(self, parameters: Parameters) -> None:
        """Apply a new cost; lanes are read once, when the layer is created."""
        self._parameters = parameters

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Draw the lanes in the new frame."""
        self._cells.lay_out(frame, shift)

    def update(self, senses: SensorUpdate) -> Box:
        """Change nothing: zones do not depend on sensors."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Raise the cost of known cells outside the lanes."""
        off = part(self._cells.cells, canvas.box) == 0
        off &= canvas.cells < self._parameters.cost_outside
        canvas.cells[off] = self._parameters.cost_outside

    def clear(self, region: Region | None) -> Box:
        """Change nothing: zones stay."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Return None: the layer marks no lethal cells."""
        return None


@dataclass(frozen=True)
class SpeedZone(Zone):
    """A polygon with a speed limit."""

    speed: float = parameter(0.3, "m/s", above=0.0, help="speed limit inside the zone")


class SpeedZonesLayer:
    """Zones with a speed limit. They add no cost; the safety stage applies the limit.

    The robot is at the limit when its base enters a zone: it brakes in time, with its deceleration,
    for zones straight ahead along its heading.
    """

    @dataclass(frozen=True)
    class Parameters:
        """Position and speed limit of the zones."""

        zones: tuple[Any, ...] = parameter(
            (), help="polygons: {corners: [[x, y], …], speed: 0.3 m/s, name: text}, map frame"
        )
        mask: str = parameter(
            "", help="a map.yaml, relative to the mission; cells 1 to 100: percent of full_speed"
        )
        full_speed: float = parameter(1.0, "m/s", above=0.0, help="speed limit of mask value 100")
        look_ahead: float = parameter(
            3.0, "m", at_least=0.0, help="distance ahead in which zones are checked"
        )

        def __post_init__(self) -> None:
            object.__setattr__(self, "zones", read_zones(SpeedZone, self.zones))

    needs_tracks: ClassVar[bool] = False
    reach = 0
    _STEP = 0.1

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        self._parameters, self._mask = parameters, read_mask(parameters.mask)

    def configure(self, parameters: Parameters) -> None:
        """Apply new parameters; the mask is read once, when the layer is created."""
        self._parameters = parameters

    def speeds_at(self, points: FloatArray) -> FloatArray:
        """Return the (n,) speed limits in m/s at points (n, 2), metres, map frame; inf if none."""
        limits = np.full(len(points), inf)
        for zone in self._parameters.zones:
            found = points_inside(points, zone.points)
            limits[found] = np.minimum(limits[found], zone.speed)
        if self._mask is not None:
            limits = np.minimum(limits, self._masked(self._mask, points))
        return limits

    def speed_limit(self, pose: Pose2D, deceleration: float) -> float:
        """Highest speed that still allows braking to the limit of every zone ahead, m/s.

        The minimum over look_ahead of v² = v_zone² + 2 · deceleration · distance.

        Args:
            pose: of the base, map frame.
            deceleration: of the robot, m/s².
        """
        if not self._parameters.zones and self._mask is None:
            return inf
        distances = np.arange(0.0, self._parameters.look_ahead + 1e-9, self._STEP)
        ahead = pose.transform(np.column_stack([distances, np.zeros(distances.size)]))
        squared = self.speeds_at(ahead) ** 2 + 2.0 * deceleration * distances
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

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Do nothing: limits are looked up by position."""

    def update(self, senses: SensorUpdate) -> Box:
        """Change nothing: zones do not depend on sensors."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Do nothing: speed limits add no cost."""

    def clear(self, region: Region | None) -> Box:
        """Change nothing: zones stay."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Return None: the layer marks no cells."""
        return None
