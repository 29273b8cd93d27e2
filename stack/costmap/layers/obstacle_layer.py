"""Obstacle layer: lidar returns mark cells, beams clear them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.costmap.layer import Box, Canvas, LayerUpdate
from stack.costmap.layers.sensed_layer import SensedLayer
from stack.costmap.parameters import ObstacleParameters
from stack.parameters import parameter
from stack.types import Pose2D, Scan


class ObstacleLayer(SensedLayer):
    """Obstacles seen by one lidar: returns mark cells, beams clear the cells that they pass.

    Returns mark cells within `obstacle_range`; beams clear up to `clearing_range`. A beam without
    return (+inf) may be one that was lost: it clears a cell only if both neighbouring beams reach
    beyond that distance or have no return either. An invalid beam (NaN) does nothing and confirms
    nothing. Cells under the robot's footprint are always cleared, and marks that were not seen for
    `decay` seconds expire. Use one layer per lidar, each with its own `source`: lidars scan
    different planes, so the beams of one must not clear the marks of another.
    """

    needs = ("lidar",)
    empty = np.uint8(0)  # the values say which cells were seen
    under_robot = 1

    @dataclass(frozen=True)
    class Parameters(ObstacleParameters):
        """Ranges and lifetime of the lidar's marks."""

        source: str = parameter(
            "lidar", public=True,
            help="name of the lidar whose scans are used; a list of layers that leaves it out has "
            "one layer for each lidar",
        )  # fmt: skip

    parameters: Parameters

    @staticmethod
    def kernels() -> KernelTypes:
        from stack.costmap import kernels

        return kernels.OBSTACLES

    @staticmethod
    def lidars(parameters: Parameters) -> tuple[str, ...]:
        return (parameters.source,)

    @property
    def marked(self) -> NDArray[np.bool_]:
        """(rows, columns): cells with a mark that has not expired."""
        marked: NDArray[np.bool_] = self._times > -np.inf
        return marked

    def _measure(self, update: LayerUpdate) -> list[Box]:
        posed = update.scans.get(self.parameters.source)
        return [] if posed is None else [self._sense(posed.pose, posed.measurement, update.time)]

    def paint(self, canvas: Canvas) -> None:
        """Paint marks as lethal; cells seen free become free where they are unknown."""
        self._kernels.paint_marks(canvas.cells, self._times, self._values, *canvas.box)

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The lidar, and the time at which it last saw the obstacle."""
        time = float(self._times[row, column])
        return None if time == -np.inf else (self.parameters.source, time)

    def _sense(self, pose: Pose2D, scan: Scan, time: float) -> Box:
        sensor, settings = pose.compose(scan.mount), self.parameters
        clearable = time - settings.persistence if settings.persistence else np.inf
        box: Box = self._kernels.sense(
            self._times, self._values, *self.frame.origin, self.frame.resolution,
            sensor.x, sensor.y, sensor.heading,
            scan.ranges, scan.angles, _is_closed(scan), scan.range_max,
            settings.obstacle_range, settings.clearing_range, time, clearable,
        )  # fmt: skip
        self._marks.add(box, time)
        return box


def _is_closed(scan: Scan) -> bool:
    """Whether the first and the last beam are neighbours."""
    beams = scan.ranges.size
    return beams > 1 and abs(scan.angle_increment) * (beams + 0.5) > 2.0 * np.pi
