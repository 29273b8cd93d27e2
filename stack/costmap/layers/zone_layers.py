"""Zone layers: keepout zones and preferred lanes.

Each accepts polygons (`zones`), a mask (a ROS map.yaml whose occupied cells are the zone), or both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import (
    NO_BOX,
    Box,
    Canvas,
    Frame,
    Layer,
    LayerUpdate,
    joined,
    part,
    sampled,
)
from stack.costmap.way_out import Lane, WayOut
from stack.costmap.zones import ZONE_MARGIN, Zone, ZoneCells, read_mask, read_zones
from stack.parameters import parameter
from stack.types import FREE, LETHAL_COST, Footprint, OccupancyGrid, Pose2D


@dataclass(frozen=True)
class _Zoned:
    """Position of the zones."""

    zones: tuple[Any, ...] = parameter(
        (), public=True,
        help="polygons: [[x, y], …] or {name: text, corners: [[x, y], …]}, map frame",
    )  # fmt: skip
    mask: str = parameter(
        "", public=True, help="a map.yaml, relative to the mission; its occupied cells are the zone"
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "zones", read_zones(Zone, self.zones))


class _ZoneLayer(Layer):
    """A layer whose zones are drawn in its frame."""

    _cells: ZoneCells

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        super().lay_out(frame, shift)
        self._cells.lay_out(frame, shift)


class KeepoutLayer(_ZoneLayer):
    """Zones that the robot must not enter; their cells are lethal.

    The whole footprint stays outside; with `inflated: false`, only the centre. A robot that stands
    in a zone may leave it by the shortest way, and by no other.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Position of the keepout zones."""

    parameters: Parameters

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._mask = read_mask(parameters.mask)
        self._cells = ZoneCells(parameters.zones, self._mask, ZONE_MARGIN)
        self._leaving: WayOut | None = None
        self._lane: Lane | None = None

    def set_map(self, grid: OccupancyGrid | None) -> None:
        """Use another map: ways out lead round its walls."""
        super().set_map(grid)
        self._leaving = self._lane = None

    def update(self, update: LayerUpdate) -> Box:
        """Open the shortest way out for a robot that stands in a zone."""
        pose, before = update.pose, self._lane
        if self._leaving is None:
            if not self._cells.covers(pose):
                return NO_BOX
            self._leaving = WayOut(
                self.parameters.zones, self._mask, self.footprint, self.map, pose
            )
        if self._leaving.is_outside(pose):
            self._leaving = self._lane = None
        elif before is None or before.left_by(pose):
            self._lane = self._leaving.lane(pose)
        if self._lane is before:
            return NO_BOX
        return joined([self._box_of(before), self._box_of(self._lane)])

    def paint(self, canvas: Canvas) -> None:
        closed = part(self._cells.cells, canvas.box) > 0
        if self._lane is not None:
            closed &= sampled(self._lane.cells, self.frame, canvas.box, FREE) == FREE
        canvas.cells[closed] = LETHAL_COST

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        name = self._cells.name_at(row, column)
        return None if name is None else (name, None)

    def forbidden(self) -> dict[str, NDArray[np.bool_]]:
        return self._cells.by_name()

    @property
    def way_out(self) -> Pose2D | None:
        return None if self._lane is None else self._lane.end

    def _box_of(self, lane: Lane | None) -> Box:
        if lane is None:
            return NO_BOX
        (x, y), (rows, columns) = lane.cells.origin, lane.cells.cells.shape
        side = lane.cells.resolution
        return self.frame.box_around((x, y), (x + columns * side, y + rows * side))


class PreferredLanesLayer(_ZoneLayer):
    """Preferred lanes: cells outside them have a minimum cost.

    Use it in the global costmap (`only: global`): a controller that slows down at high costs would
    be slow everywhere outside the lanes.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Position of the lanes and the cost outside them."""

        cost_outside: int = parameter(
            60, at_least=1, at_most=252, public=True, help="minimum cost outside the lanes"
        )

    inflated: ClassVar[bool] = False
    parameters: Parameters

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._cells = ZoneCells(parameters.zones, read_mask(parameters.mask))

    def paint(self, canvas: Canvas) -> None:
        """Raise the cost of known cells outside the lanes."""
        off = part(self._cells.cells, canvas.box) == 0
        off &= canvas.cells < self.parameters.cost_outside
        canvas.cells[off] = self.parameters.cost_outside
