"""What sonar-like sensors hear as a costmap layer."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import (
    NO_BOX,
    Box,
    Canvas,
    Frame,
    Region,
    SensorUpdate,
    is_some,
    joined,
    part,
    shifted,
)
from stack.errors import ParameterError
from stack.parameters import parameter
from stack.types import (
    FREE_COST,
    LETHAL_COST,
    UNKNOWN_COST,
    Footprint,
    Pose2D,
    RangeReading,
)

_EVEN = 0.5
_EXPIRY_PERIOD = 0.5


class RangeLayer:
    """What sonar-like sensors hear: something somewhere in a cone, so cells are guessed at.

    Each cell keeps the probability that it is occupied, 0.5 to begin with, updated by Bayes' rule
    with the sensor model of Nav2's RangeSensorLayer: above `mark_above` a cell is lethal, below
    `free_below` free. Cells that no reading spoke of for `decay` seconds are forgotten.
    """

    @dataclass(frozen=True)
    class Parameters:
        """How readings are trusted."""

        mark_above: float = parameter(
            0.8, above=0.5, at_most=0.98, help="probability above which a cell is an obstacle"
        )
        free_below: float = parameter(
            0.2, at_least=0.02, at_most=0.5, help="probability below which a cell is free"
        )
        fading: float = parameter(
            1.2, "m", above=0.0, help="round this distance readings cease to be trusted"
        )
        accuracy: float = parameter(
            0.05, above=0.0, at_most=0.5, help="share of the distance that a reading may be off"
        )
        clear_without_return: bool = parameter(
            True, help="a reading without return frees the whole cone"
        )
        decay: float = parameter(60.0, "s", at_least=0.0, help="forgets after this; 0 is never")

        def __post_init__(self) -> None:
            if self.free_below >= self.mark_above:
                raise ParameterError(
                    "free_below", f"{self.free_below:g} is not below mark_above {self.mark_above:g}"
                )

    needs_tracks: ClassVar[bool] = False
    reach = 0

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._parameters, self._footprint = parameters, footprint
        self._frame = Frame((0, 0), 1.0, (0.0, 0.0))
        self._probability = np.empty((0, 0), dtype=np.float32)
        self._heard_at = np.empty((0, 0), dtype=np.float32)
        self._source, self._next_expiry = "sonar", 0.0

    @property
    def marked(self) -> NDArray[np.bool_]:
        """(rows, columns): where an obstacle is believed to be."""
        marked: NDArray[np.bool_] = self._probability > self._parameters.mark_above
        return marked

    def configure(self, parameters: Parameters) -> None:
        """Use other settings from now on; probabilities stay."""
        self._parameters = parameters

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Keep the probabilities where they are on the floor."""
        self._frame = frame
        if shift is None:
            self._probability = np.full(frame.shape, _EVEN, dtype=np.float32)
            self._heard_at = np.full(frame.shape, -np.inf, dtype=np.float32)
        else:
            self._probability = shifted(self._probability, frame.shape, shift, _EVEN)
            self._heard_at = shifted(self._heard_at, frame.shape, shift, -np.inf)

    def update(self, senses: SensorUpdate) -> Box:
        """Take in readings, let old ones fade, and forget what is under the robot."""
        touched = [self._forget_old(senses.time)]
        touched += [self._hear(senses.pose, item, senses.time) for item in senses.readings]
        touched.append(self._clear_footprint(senses.pose))
        return joined(touched)

    def paint(self, canvas: Canvas) -> None:
        """Likely cells are lethal, unlikely ones free where nothing else is known."""
        probability = part(self._probability, canvas.box)
        free = (probability < self._parameters.free_below) & (canvas.cells == UNKNOWN_COST)
        canvas.cells[free] = FREE_COST
        canvas.cells[probability > self._parameters.mark_above] = LETHAL_COST

    def clear(self, region: Region | None) -> Box:
        """Forget every reading."""
        if region is None:
            self._probability[:], self._heard_at[:] = _EVEN, -np.inf
            return self._frame.everywhere
        if not is_some(region.box):
            return NO_BOX
        part(self._probability, region.box)[region.inside] = _EVEN
        part(self._heard_at, region.box)[region.inside] = -np.inf
        return region.box

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The sensor that spoke last, and when a reading last spoke of the cell."""
        if self._probability[row, column] <= self._parameters.mark_above:
            return None
        return self._source, float(self._heard_at[row, column])

    def _hear(self, pose: Pose2D, reading: RangeReading, time: float) -> Box:
        distance, settings = reading.distance, self._parameters
        if isnan(distance) or distance < reading.range_min:
            return NO_BOX
        returned = distance < reading.range_max
        if not returned and not settings.clear_without_return:
            return NO_BOX
        sensor = pose.compose(reading.mount)
        thickness = max(self._frame.resolution, settings.accuracy * distance) if returned else 0.0
        end = distance + thickness if returned else reading.range_max
        box = self._frame.box_around(
            (sensor.x - end, sensor.y - end), (sensor.x + end, sensor.y + end)
        )
        self._source = reading.source
        self._kernels.hear(
            self._probability, self._heard_at, *self._frame.origin, self._frame.resolution,
            sensor.x, sensor.y, sensor.heading, distance if returned else inf, end,
            0.5 * reading.field_of_view, settings.fading, thickness, time, *box,
        )  # fmt: skip
        return box

    def _forget_old(self, time: float) -> Box:
        if self._parameters.decay == 0.0 or time < self._next_expiry:
            return NO_BOX
        self._next_expiry = time + _EXPIRY_PERIOD
        oldest = time - self._parameters.decay
        box: Box = self._kernels.expire(self._heard_at, oldest, *self._frame.everywhere)
        if is_some(box):
            faded = part(self._heard_at, box) == -np.inf
            part(self._probability, box)[faded] = _EVEN
        return box

    def _clear_footprint(self, pose: Pose2D) -> Box:
        from stack.costmap.zones import cells_inside

        corners = pose.transform(self._footprint.points)
        box, inside = cells_inside(self._frame, corners, self._frame.everywhere)
        return self.clear(Region(box, inside))
