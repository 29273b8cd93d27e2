"""Zone layers: keepout zones and preferred lanes.

Each accepts polygons (`zones`), a mask (a ROS map.yaml whose occupied cells are the zone), or both.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stack.costmap.layer import Canvas, Frame, Layer, part
from stack.costmap.zones import Zone, ZoneCells, read_mask, read_zones
from stack.parameters import parameter
from stack.types import LETHAL_COST, Footprint


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


class KeepoutLayer(Layer):
    """Zones that the robot must not enter; their cells are lethal.

    The whole footprint stays outside; with `inflated: false`, only the centre.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Position of the keepout zones."""

    parameters: Parameters

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._cells = ZoneCells(parameters.zones, read_mask(parameters.mask))

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Draw the zones in the new frame."""
        super().lay_out(frame, shift)
        self._cells.lay_out(frame, shift)

    def paint(self, canvas: Canvas) -> None:
        """Paint cells inside a zone as lethal."""
        canvas.cells[part(self._cells.cells, canvas.box) > 0] = LETHAL_COST

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The name of the zone, None outside."""
        name = self._cells.name_at(row, column)
        return None if name is None else (name, None)


class PreferredLanesLayer(Layer):
    """Preferred lanes: cells outside them have a minimum cost.

    Use it in the global costmap (`only: global`): a controller that slows down at high costs would
    be slow everywhere outside the lanes.
    """

    @dataclass(frozen=True)
    class Parameters(_Zoned):
        """Position of the lanes and the cost outside them."""

        cost_outside: int = parameter(
            60, at_least=1, at_most=252, help="minimum cost outside the lanes"
        )

    inflated: ClassVar[bool] = False
    parameters: Parameters

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._cells = ZoneCells(parameters.zones, read_mask(parameters.mask))

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Draw the lanes in the new frame."""
        super().lay_out(frame, shift)
        self._cells.lay_out(frame, shift)

    def paint(self, canvas: Canvas) -> None:
        """Raise the cost of known cells outside the lanes."""
        off = part(self._cells.cells, canvas.box) == 0
        off &= canvas.cells < self.parameters.cost_outside
        canvas.cells[off] = self.parameters.cost_outside
