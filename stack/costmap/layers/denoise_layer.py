"""Costmap layer that removes small groups of sensed cells."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from stack.compilation import KernelTypes
from stack.costmap.layer import Canvas, Layer
from stack.parameters import parameter
from stack.types import Footprint


class DenoiseLayer(Layer):
    """Removes small groups of lethal cells, which are probably noise.

    Groups are 8-connected. Lethal cells of the map and the groups that touch them are kept. List it
    after the layers that it filters. Modelled on Nav2's DenoiseLayer.
    """

    @dataclass(frozen=True)
    class Parameters:
        """Size of the groups that count as noise."""

        smallest_group: int = parameter(
            2, at_least=2, at_most=16, public=True,
            help="smaller groups of connected cells are removed",
        )  # fmt: skip

    parameters: Parameters

    @staticmethod
    def kernels() -> KernelTypes:
        from stack.costmap import kernels

        return kernels.DENOISING

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        from stack.costmap import kernels

        self._kernels: Any = kernels

    @property
    def reach(self) -> int:
        """Largest distance between two cells of a group that is removed, in cells."""
        return self.parameters.smallest_group - 1

    def paint(self, canvas: Canvas) -> None:
        """Reset removed cells to the map's cost; free where the map is unknown."""
        self._kernels.drop_small_groups(canvas.cells, canvas.ground, self.parameters.smallest_group)
