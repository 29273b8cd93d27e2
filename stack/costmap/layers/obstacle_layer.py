"""Obstacle layer: lidar returns mark cells, beams clear them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.costmap.layer import (
    NO_BOX,
    Box,
    Canvas,
    Frame,
    Layer,
    LayerUpdate,
    Region,
    is_some,
    joined,
    moved,
    part,
    shifted,
)
from stack.costmap.mark_boxes import MarkBoxes
from stack.costmap.parameters import ObstacleParameters
from stack.parameters import parameter
from stack.types import Footprint, Pose2D, Scan

_EXPIRY_PERIOD = 0.5
"""Seconds between two searches for old marks."""


class ObstacleLayer(Layer):
    """Obstacles seen by one lidar: returns mark cells, beams clear the cells that they pass.

    Returns mark cells within `obstacle_range`; beams clear up to `clearing_range`. A beam without
    return (+inf) may be one that was lost: it clears a cell only if both neighbouring beams reach
    beyond that distance or have no return either. An invalid beam (NaN) does nothing and confirms
    nothing. Cells under the robot's footprint are always cleared, and marks that were not seen for
    `decay` seconds expire. Use one layer per lidar, each with its own `source`: lidars scan
    different planes, so the beams of one must not clear the marks of another.
    """

    needs = ("lidar",)

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
        """Return the kernels of the layer."""
        from stack.costmap import kernels

        return kernels.OBSTACLES

    @staticmethod
    def lidars(parameters: Parameters) -> tuple[str, ...]:
        """Return the one lidar."""
        return (parameters.source,)

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._next_expiry = 0.0
        self._marks = MarkBoxes()
        self._sensed = NO_BOX  # contains all cells marked or seen free
        self._marked_at = np.empty((0, 0), dtype=np.float32)
        self._seen = np.empty((0, 0), dtype=np.uint8)

    @property
    def marked(self) -> NDArray[np.bool_]:
        """(rows, columns): cells with a mark that has not expired."""
        marked: NDArray[np.bool_] = self._marked_at > -np.inf
        return marked

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Move the grid; marks keep their positions in the map frame."""
        self.frame = frame
        self._sensed = NO_BOX if shift is None else moved(self._sensed, frame.shape, shift)
        if shift is None:
            self._marks.clear()
            self._marked_at = np.full(frame.shape, -np.inf, dtype=np.float32)
            self._seen = np.zeros(frame.shape, dtype=np.uint8)
        else:
            self._marks.move(frame.shape, shift)
            self._marked_at = shifted(self._marked_at, frame.shape, shift, -np.inf)
            self._seen = shifted(self._seen, frame.shape, shift, 0)

    def update(self, update: LayerUpdate) -> Box:
        """Expire old marks, add a scan, and clear the cells under the footprint."""
        touched = [self._forget_old(update.time)]
        posed = update.scans.get(self.parameters.source)
        if posed is not None:
            touched.append(self._sense(posed.pose, posed.scan, update.time))
        touched.append(self._clear_footprint(update.pose))
        changed = joined(touched)
        self._sensed = joined([self._sensed, changed])
        return changed

    def paint(self, canvas: Canvas) -> None:
        """Paint marks as lethal; cells seen free become free where they are unknown."""
        self._kernels.paint_marks(canvas.cells, self._marked_at, self._seen, *canvas.box)

    def clear(self, region: Region | None) -> Box:
        """Clear marks and cells seen free."""
        if region is None:
            part(self._marked_at, self._sensed)[:] = -np.inf
            part(self._seen, self._sensed)[:] = 0
            self._marks.clear()
            sensed, self._sensed = self._sensed, NO_BOX
            return sensed
        if not is_some(region.box):
            return NO_BOX
        part(self._marked_at, region.box)[region.inside] = -np.inf
        part(self._seen, region.box)[region.inside] = 0
        return region.box

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The lidar, and the time at which it last saw the obstacle."""
        time = float(self._marked_at[row, column])
        return None if time == -np.inf else (self.parameters.source, time)

    def _forget_old(self, time: float) -> Box:
        if self.parameters.decay == 0.0 or time < self._next_expiry:
            return NO_BOX
        self._next_expiry = time + _EXPIRY_PERIOD
        return self._marks.expire(self._marked_at, time - self.parameters.decay)

    def _sense(self, pose: Pose2D, scan: Scan, time: float) -> Box:
        sensor, settings = pose.compose(scan.mount), self.parameters
        clearable = time - settings.persistence if settings.persistence else np.inf
        box: Box = self._kernels.sense(
            self._marked_at, self._seen, *self.frame.origin, self.frame.resolution,
            sensor.x, sensor.y, sensor.heading,
            scan.ranges, scan.angles, _is_closed(scan), scan.range_max,
            settings.obstacle_range, settings.clearing_range, time, clearable,
        )  # fmt: skip
        self._marks.add(box, time)
        return box

    def _clear_footprint(self, pose: Pose2D) -> Box:
        corners = pose.transform(self.footprint.points)
        box: Box = self._kernels.clear_polygon(
            self._marked_at, self._seen, 1, *self.frame.origin, self.frame.resolution, corners
        )
        return box


def _is_closed(scan: Scan) -> bool:
    """Whether the first and the last beam are neighbours."""
    beams = scan.ranges.size
    return beams > 1 and abs(scan.angle_increment) * (beams + 0.5) > 2.0 * np.pi
