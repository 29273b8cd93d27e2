"""Rules of a place as costmap layers: keep out, keep to the lanes, keep to a speed.

Each takes polygons (`zones`), a mask (a ROS map.yaml whose occupied cells are the zone), or both.
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
    """Where zones are."""

    zones: tuple[Any, ...] = parameter(
        (), help="polygons: [[x, y], …] or {name: text, corners: [[x, y], …]}, map frame"
    )
    mask: str = parameter("", help="a map.yaml, relative to the mission; occupied is in the zone")

    def __post_init__(self) -> None:
        object.__setattr__(self, "zones", read_zones(Zone, self.zones))


class KeepoutLayer:
    """Places that the robot must not enter, as if there were walls round them.

    Before `inflation` in the list the whole footprint stays out, after it only its centre.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Where it must not go."""

    needs_tracks: ClassVar[bool] = False
    reach = 0

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        self._cells = ZoneCells(parameters.zones, read_mask(parameters.mask))

    def configure(self, parameters: Parameters) -> None:
        """Zones are read once."""

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Draw the zones where the cells are now."""
        self._cells.lay_out(frame, shift)

    def update(self, senses: SensorUpdate) -> Box:
        """Nothing that is sensed changes a rule."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Lethal inside."""
        canvas.cells[part(self._cells.cells, canvas.box) > 0] = LETHAL_COST

    def clear(self, region: Region | None) -> Box:
        """Rules stay."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The zone's name."""
        name = self._cells.name_at(row, column)
        return None if name is None else (name, None)


class PreferredLanesLayer:
    """Lanes to keep to where one can: every place off them costs something.

    Stands after `inflation`. Meant for the global costmap (`only: global`): a controller that
    slows down where it is costly would crawl off the lanes.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Where the lanes are and what leaving them costs."""

        cost_outside: int = parameter(
            60, at_least=1, at_most=252, help="places off the lanes cost at least this"
        )

    needs_tracks: ClassVar[bool] = False
    reach = 0

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        self._parameters = parameters
        self._cells = ZoneCells(parameters.zones, read_mask(parameters.mask))

    def configure(self, parameters: Parameters) -> None:
        """Lanes are read once; their cost may change."""
        self._parameters = parameters

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Draw the lanes where the cells are now."""
        self._cells.lay_out(frame, shift)

    def update(self, senses: SensorUpdate) -> Box:
        """Nothing that is sensed changes a rule."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Raise what is known and lies off the lanes."""
        off = part(self._cells.cells, canvas.box) == 0
        off &= canvas.cells < self._parameters.cost_outside
        canvas.cells[off] = self._parameters.cost_outside

    def clear(self, region: Region | None) -> Box:
        """Rules stay."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Marks nothing lethal."""
        return None


@dataclass(frozen=True)
class SpeedZone(Zone):
    """A polygon with a speed limit."""

    speed: float = parameter(0.3, "m/s", above=0.0, help="no faster than this inside")


class SpeedZonesLayer:
    """Places with a speed limit. They cost nothing; the safety stage keeps to the limit.

    The robot has the limit's speed when its base enters: on the way there it slows down as its
    deceleration asks for, looking straight ahead along its heading.
    """

    @dataclass(frozen=True)
    class Parameters:
        """Where the limits are."""

        zones: tuple[Any, ...] = parameter(
            (), help="polygons: {corners: [[x, y], …], speed: 0.3 m/s, name: text}, map frame"
        )
        mask: str = parameter(
            "", help="a map.yaml, relative to the mission; 1 to 100 are percent of full_speed"
        )
        full_speed: float = parameter(1.0, "m/s", above=0.0, help="what 100 in the mask means")
        look_ahead: float = parameter(3.0, "m", at_least=0.0, help="slows down for zones this far")

        def __post_init__(self) -> None:
            object.__setattr__(self, "zones", read_zones(SpeedZone, self.zones))

    needs_tracks: ClassVar[bool] = False
    reach = 0
    _STEP = 0.1

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        self._parameters, self._mask = parameters, read_mask(parameters.mask)

    def configure(self, parameters: Parameters) -> None:
        """The mask is read once."""
        self._parameters = parameters

    def speeds_at(self, points: FloatArray) -> FloatArray:
        """(n,) limits in m/s at points (n, 2), metres, map frame; inf where there is none."""
        limits = np.full(len(points), inf)
        for zone in self._parameters.zones:
            found = points_inside(points, zone.points)
            limits[found] = np.minimum(limits[found], zone.speed)
        if self._mask is not None:
            limits = np.minimum(limits, self._masked(self._mask, points))
        return limits

    def speed_limit(self, pose: Pose2D, deceleration: float) -> float:
        """The speed from which no zone straight ahead is entered too fast, m/s.

        v² = v_zone² + 2 · deceleration · distance, the smallest over look_ahead.

        Args:
            pose: of the base, map frame.
            deceleration: m/s² that the robot can brake with.
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
        """Limits are looked up by place."""

    def update(self, senses: SensorUpdate) -> Box:
        """Nothing that is sensed changes a rule."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Limits cost nothing."""

    def clear(self, region: Region | None) -> Box:
        """Rules stay."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Marks nothing."""
        return None
