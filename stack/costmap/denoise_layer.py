"""Costmap layer that removes small groups of sensed cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stack.costmap.layer import NO_BOX, Box, Canvas, Frame, Region, SensorUpdate
from stack.parameters import parameter
from stack.types import Footprint


class DenoiseLayer:
    """Removes small groups of lethal cells, which are probably noise.

    Groups are 8-connected. Lethal cells of the map and the groups that touch them are kept. List it
    after the layers that it filters and before `inflation`. Modelled on Nav2's DenoiseLayer.
    """

    @dataclass(frozen=True)
    class Parameters:
        """Size of the groups that count as noise."""

        smallest_group: int = parameter(
            2, at_least=2, at_most=16, help="smaller groups of connected cells are removed"
        )

    needs_tracks: ClassVar[bool] = False

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._parameters = parameters

    @property
    def reach(self) -> int:
        """Largest distance between two cells of a group that is removed, in cells."""
        return self._parameters.smallest_group - 1

    def configure(self, parameters: Parameters) -> None:
        """Apply new parameters."""
        self._parameters = parameters

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Do nothing: the layer stores no cells."""

    def update(self, senses: SensorUpdate) -> Box:
        """Change nothing: the layer uses no sensor data."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Reset removed cells to the map's cost; free where the map is unknown."""
        self._kernels.drop_small_groups(
            canvas.cells, canvas.ground, self._parameters.smallest_group
        )

    def clear(self, region: Region | None) -> Box:
        """Change nothing: the layer stores nothing."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Return None: the layer marks no cells."""
        return None
