"""Range layer: obstacles from sonars and other range sensors with a cone."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan
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
    part,
    shifted,
)
from stack.costmap.mark_boxes import MarkBoxes
from stack.parameters import parameter
from stack.types import (
    FREE_COST,
    LETHAL_COST,
    UNKNOWN_COST,
    Footprint,
    Pose2D,
    RangeReading,
)

MARK_ABOVE = 0.8
"""Probability above which a cell is an obstacle."""
FREE_BELOW = 0.2
"""Probability below which a cell is free."""
ACCURACY = 0.05
"""Error of a reading, as a share of the distance."""

_PRIOR = 0.5
_EXPIRY_PERIOD = 0.5
"""Seconds between two searches for old cells."""


class RangeLayer(Layer):
    """Obstacles from range sensors, which detect something anywhere in their cone.

    Each cell holds the probability that it is occupied, initially 0.5, updated by Bayes' rule with
    the sensor model of Nav2's RangeSensorLayer. Above MARK_ABOVE a cell is lethal, below
    FREE_BELOW it is free. Cells that were not updated for `decay` seconds return to 0.5.

    In Nav2's model the confidence is 0 at the rim of the cone, and small beyond 1.2 m. A robot that
    passes a wall has it only there, and would leave most of it, and its ends, unmarked. Here the
    confidence is by default the same in the whole cone (`rim`), also that in free cells, and
    reaches farther (`fading`). `rim: 0, fading: 1.2 m` is Nav2's model.
    """

    needs = ("sonar",)

    @dataclass(frozen=True)
    class Parameters:
        """Sensor model and lifetime of readings."""

        rim: float = parameter(
            1.0, at_least=0.0, at_most=1.0,
            help="confidence at the rim of the cone, as a share of that on its axis",
        )  # fmt: skip
        fading: float = parameter(
            1.8, "m", above=0.0, help="distance around which the confidence in readings falls"
        )
        decay: float = parameter(
            60.0, "s", at_least=0.0, help="cells not updated for this long are reset; 0: never"
        )

    parameters: Parameters

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the kernels of the layer."""
        from stack.costmap import kernels

        return kernels.RANGES

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._probability = np.empty((0, 0), dtype=np.float32)
        self._heard_at = np.empty((0, 0), dtype=np.float32)
        self._source, self._next_expiry = "sonar", 0.0
        self._heard = MarkBoxes()  # all updated cells

    @property
    def marked(self) -> NDArray[np.bool_]:
        """(rows, columns): cells whose probability is above MARK_ABOVE."""
        marked: NDArray[np.bool_] = self._probability > MARK_ABOVE
        return marked

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Move the grid; probabilities keep their positions in the map frame."""
        self.frame = frame
        if shift is None:
            self._heard.clear()
            self._probability = np.full(frame.shape, _PRIOR, dtype=np.float32)
            self._heard_at = np.full(frame.shape, -np.inf, dtype=np.float32)
        else:
            self._heard.move(frame.shape, shift)
            self._probability = shifted(self._probability, frame.shape, shift, _PRIOR)
            self._heard_at = shifted(self._heard_at, frame.shape, shift, -np.inf)

    def update(self, update: LayerUpdate) -> Box:
        """Expire old cells, add readings, and clear the cells under the footprint."""
        touched = [self._forget_old(update.time)]
        touched += [self._hear(item.pose, item.reading, update.time) for item in update.readings]
        touched.append(self._clear_footprint(update.pose))
        return joined(touched)

    def paint(self, canvas: Canvas) -> None:
        """Paint probable cells as lethal; improbable ones become free where they are unknown."""
        probability = part(self._probability, canvas.box)
        free = (probability < FREE_BELOW) & (canvas.cells == UNKNOWN_COST)
        canvas.cells[free] = FREE_COST
        canvas.cells[probability > MARK_ABOVE] = LETHAL_COST

    def clear(self, region: Region | None) -> Box:
        """Reset the probabilities."""
        if region is None:
            self._probability[:], self._heard_at[:] = _PRIOR, -np.inf
            self._heard.clear()
            return self.frame.everywhere
        if not is_some(region.box):
            return NO_BOX
        part(self._probability, region.box)[region.inside] = _PRIOR
        part(self._heard_at, region.box)[region.inside] = -np.inf
        return region.box

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The sensor of the newest reading, and the time of the cell's last update."""
        if self._probability[row, column] <= MARK_ABOVE:
            return None
        return self._source, float(self._heard_at[row, column])

    def _hear(self, pose: Pose2D, reading: RangeReading, time: float) -> Box:
        distance, settings = reading.distance, self.parameters
        if isnan(distance) or distance < reading.range_min:
            return NO_BOX
        returned = distance < reading.range_max
        sensor = pose.compose(reading.mount)
        thickness = max(self.frame.resolution, ACCURACY * distance) if returned else 0.0
        end = distance + thickness if returned else reading.range_max
        box = self.frame.box_around(
            (sensor.x - end, sensor.y - end), (sensor.x + end, sensor.y + end)
        )
        self._source = reading.source
        self._heard.add(box, time)
        self._kernels.hear(
            self._probability, self._heard_at, *self.frame.origin, self.frame.resolution,
            sensor.x, sensor.y, sensor.heading, distance if returned else inf, end,
            0.5 * reading.field_of_view, settings.rim, settings.fading, thickness, time, *box,
        )  # fmt: skip
        return box

    def _forget_old(self, time: float) -> Box:
        if self.parameters.decay == 0.0 or time < self._next_expiry:
            return NO_BOX
        self._next_expiry = time + _EXPIRY_PERIOD
        cleared = self._heard.expire(self._heard_at, time - self.parameters.decay)
        if is_some(cleared):
            faded = part(self._heard_at, cleared) == -np.inf
            part(self._probability, cleared)[faded] = _PRIOR
        return cleared

    def _clear_footprint(self, pose: Pose2D) -> Box:
        corners, (x, y) = pose.transform(self.footprint.points), self.frame.origin
        box: Box = self._kernels.clear_polygon(
            self._heard_at, self._probability, _PRIOR, x, y, self.frame.resolution, corners
        )
        return box
