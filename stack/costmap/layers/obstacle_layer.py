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

_UNMET = 5.0
"""Seconds without a beam that met it, after which a mark between two beams is cleared."""

_NARROW = 0.1
"""Metres: beams that are farther apart there do not show that nothing stands between them."""

_LOOK_PERIOD = 0.5
"""Seconds between two searches for such marks."""


class ObstacleLayer(SensedLayer):
    """Obstacles seen by one lidar: returns mark cells, beams clear the cells that they pass.

    Returns mark cells within `obstacle_range`; beams clear up to `clearing_range`. A beam without
    return (+inf) may be one that was lost: it clears a cell only if both neighbouring beams reach
    beyond that distance or have no return either. An invalid beam (NaN) does nothing and confirms
    nothing. A robot that stands sees only the cells along its beams, which leave cells out farther
    away: a mark between two near beams that both reach beyond it is cleared when no beam has met it
    for some seconds. Cells under the robot's footprint are always cleared, and marks that were not
    seen for `decay` seconds expire. Use one layer per lidar, each with its own `source`: lidars
    scan different planes, so the beams of one must not clear the marks of another.
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
    _next_look = 0.0

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
        if posed is None:
            return []
        boxes = [self._sense(posed.pose, posed.measurement, update.time)]
        has_neighbours = posed.measurement.ranges.size > 1 and posed.measurement.angle_increment
        if has_neighbours and update.time >= self._next_look:
            self._next_look = update.time + _LOOK_PERIOD
            boxes += self._clear_passed(posed.pose, posed.measurement, update.time)
        return boxes

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

    def _clear_passed(self, pose: Pose2D, scan: Scan, time: float) -> list[Box]:
        """Clear marks between beams that reach beyond them; return the boxes of cleared cells."""
        sensor, settings = pose.compose(scan.mount), self.parameters
        oldest = time - max(_UNMET, settings.persistence)
        x, y, far = sensor.x, sensor.y, settings.clearing_range
        around = self.frame.box_around((x - far, y - far), (x + far, y + far))
        return [
            self._kernels.clear_passed(
                self._times, *self.frame.origin, self.frame.resolution,
                x, y, sensor.heading, scan.ranges, scan.angles, _is_closed(scan),
                scan.range_max, far, _NARROW, oldest, *box,
            )
            for box in self._marks.older(oldest, around)
        ]  # fmt: skip


def _is_closed(scan: Scan) -> bool:
    """Whether the first and the last beam are neighbours."""
    beams = scan.ranges.size
    return beams > 1 and abs(scan.angle_increment) * (beams + 0.5) > 2.0 * np.pi
