"""Base class of layers that mark cells with the time of a measurement, which expires."""

from __future__ import annotations

from abc import abstractmethod
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import (
    NO_BOX,
    Box,
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
from stack.types import Footprint, Pose2D

_EXPIRY_PERIOD = 0.5
"""Seconds between two searches for old marks."""


class SensedLayer(Layer):
    """Marks of a range sensor: the time of each, and a value of each cell.

    Cells under the robot's footprint are always cleared, and marks older than the parameter `decay`
    expire.

    Attributes:
        empty: value of a cell that nothing was measured of; its type is that of all values.
        under_robot: value of the cells under the robot.
    """

    empty: ClassVar[np.uint8 | np.float32]
    under_robot: ClassVar[float]

    def __init__(self, parameters: Any, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._next_expiry = 0.0
        self._marks = MarkBoxes()
        self._sensed = NO_BOX  # contains all cells that are not empty
        self._times = np.empty((0, 0), dtype=np.float32)
        self._values: NDArray[Any] = np.empty((0, 0), dtype=self.empty.dtype)

    @abstractmethod
    def _measure(self, update: LayerUpdate) -> list[Box]:
        """Add measurements; return the boxes of the cells that may have changed."""

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Move the grid; marks keep their positions in the map frame."""
        self.frame = frame
        self._sensed = NO_BOX if shift is None else moved(self._sensed, frame.shape, shift)
        if shift is None:
            self._marks.clear()
            self._times = np.full(frame.shape, -np.inf, dtype=np.float32)
            self._values = np.full(frame.shape, self.empty)
        else:
            self._marks.move(frame.shape, shift)
            self._times = shifted(self._times, frame.shape, shift, -np.inf)
            self._values = shifted(self._values, frame.shape, shift, float(self.empty))

    def update(self, update: LayerUpdate) -> Box:
        """Expire old marks, add measurements, and clear the cells under the footprint."""
        touched = [self._forget_old(update.time), *self._measure(update)]
        changed = joined([*touched, self._clear_footprint(update.pose)])
        self._sensed = joined([self._sensed, changed])
        return changed

    def clear(self, region: Region | None) -> Box:
        if region is None:
            part(self._times, self._sensed)[:] = -np.inf
            part(self._values, self._sensed)[:] = self.empty
            self._marks.clear()
            sensed, self._sensed = self._sensed, NO_BOX
            return sensed
        if not is_some(region.box):
            return NO_BOX
        part(self._times, region.box)[region.inside] = -np.inf
        part(self._values, region.box)[region.inside] = self.empty
        return region.box

    def _forget_old(self, time: float) -> Box:
        if self.parameters.decay == 0.0 or time < self._next_expiry:
            return NO_BOX
        self._next_expiry = time + _EXPIRY_PERIOD
        return self._marks.expire(self._times, time - self.parameters.decay)

    def _clear_footprint(self, pose: Pose2D) -> Box:
        box: Box = self._kernels.clear_polygon(
            self._times, self._values, self.under_robot, *self.frame.origin,
            self.frame.resolution, pose.transform(self.footprint.points),
        )  # fmt: skip
        return box
