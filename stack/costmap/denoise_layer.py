"""Drops small groups of sensed cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stack.costmap.layer import NO_BOX, Box, Canvas, Frame, Region, SensorUpdate
from stack.parameters import parameter
from stack.types import Footprint


class DenoiseLayer:
    """Drops groups of lethal cells that are smaller than something real.

    A group is connected over eight neighbours. Cells of the map are never dropped, and what touches
    them is not small. Stands behind the layers whose marks it looks at, before `inflation`. After
    Nav2's DenoiseLayer.
    """

    @dataclass(frozen=True)
    class Parameters:
        """What counts as noise."""

        smallest_group: int = parameter(
            2, at_least=2, at_most=16, help="connected cells that are kept; fewer are dropped"
        )

    needs_tracks: ClassVar[bool] = False

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._parameters = parameters

    @property
    def reach(self) -> int:
        """A group too small ends within this many cells."""
        return self._parameters.smallest_group - 1

    def configure(self, parameters: Parameters) -> None:
        """Use other settings from now on."""
        self._parameters = parameters

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Knows nothing of places."""

    def update(self, senses: SensorUpdate) -> Box:
        """Senses nothing itself."""
        return NO_BOX

    def paint(self, canvas: Canvas) -> None:
        """Give dropped cells back to the map, or free them where it knows nothing."""
        self._kernels.drop_small_groups(
            canvas.cells, canvas.ground, self._parameters.smallest_group
        )

    def clear(self, region: Region | None) -> Box:
        """There is nothing to forget."""
        return NO_BOX

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Marks nothing."""
        return None
