"""Range layer: obstacles from sonars and other range sensors with a cone."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.costmap.layer import NO_BOX, Box, Canvas, LayerUpdate, is_some, part
from stack.costmap.layers.sensed_layer import SensedLayer
from stack.parameters import parameter
from stack.types import FREE_COST, LETHAL_COST, UNKNOWN_COST, Footprint, Pose2D, RangeReading

MARK_ABOVE = 0.8
"""Probability above which a cell is an obstacle."""
FREE_BELOW = 0.2
"""Probability below which a cell is free."""
RANGE_ERROR_SHARE = 0.05
"""Error of a reading, as a share of the distance."""

_PRIOR = np.float32(0.5)


class RangeLayer(SensedLayer):
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
    empty = _PRIOR  # the values are the probabilities
    under_robot = float(_PRIOR)

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
        from stack.costmap import kernels

        return kernels.RANGES

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        self._source = "sonar"

    @property
    def marked(self) -> NDArray[np.bool_]:
        """(rows, columns): cells whose probability is above MARK_ABOVE."""
        marked: NDArray[np.bool_] = self._values > MARK_ABOVE
        return marked

    def _measure(self, update: LayerUpdate) -> list[Box]:
        return [self._hear(item.pose, item.measurement, update.time) for item in update.readings]

    def paint(self, canvas: Canvas) -> None:
        """Paint probable cells as lethal; improbable ones become free where they are unknown."""
        probability = part(self._values, canvas.box)
        free = (probability < FREE_BELOW) & (canvas.cells == UNKNOWN_COST)
        canvas.cells[free] = FREE_COST
        canvas.cells[probability > MARK_ABOVE] = LETHAL_COST

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """The sensor of the newest reading, and the time of the cell's last update."""
        if self._values[row, column] <= MARK_ABOVE:
            return None
        return self._source, float(self._times[row, column])

    def _hear(self, pose: Pose2D, reading: RangeReading, time: float) -> Box:
        distance, settings = reading.distance, self.parameters
        if isnan(distance) or distance < reading.range_min:
            return NO_BOX
        returned = distance < reading.range_max
        sensor = pose.compose(reading.mount)
        thickness = max(self.frame.resolution, RANGE_ERROR_SHARE * distance) if returned else 0.0
        end = distance + thickness if returned else reading.range_max
        box = self.frame.box_around(
            (sensor.x - end, sensor.y - end), (sensor.x + end, sensor.y + end)
        )
        self._source = reading.source
        self._marks.add(box, time)
        self._kernels.hear(
            self._values, self._times, *self.frame.origin, self.frame.resolution,
            sensor.x, sensor.y, sensor.heading, distance if returned else inf, end,
            0.5 * reading.field_of_view, settings.rim, settings.fading, thickness, time, *box,
        )  # fmt: skip
        return box

    def _forget_old(self, time: float) -> Box:
        cleared = super()._forget_old(time)
        if is_some(cleared):
            faded = part(self._times, cleared) == -np.inf
            part(self._values, cleared)[faded] = _PRIOR
        return cleared
