"""Social layer: costs where moving people are predicted to be."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

from stack.compilation import KernelTypes
from stack.costmap.layer import (
    NO_BOX,
    Box,
    Canvas,
    Costs,
    Layer,
    LayerUpdate,
    Region,
    is_some,
    joined,
)
from stack.parameters import parameter
from stack.types import Footprint, TrackedObject

SIDE_DEVIATION = 0.3
"""Standard deviation of the cost to the side, m."""

FADE_AT_HORIZON = 0.6
"""Share of the cost lost at the horizon."""

_WIDEST = 3.0
"""Lateral distance beyond which no cost is added, in standard deviations."""


class SocialLayer(Layer):
    """Costs along the predicted motion of people, so that paths pass behind them.

    A person at p with velocity v moves along p + v t. A cell whose nearest point on this line is
    reached at time t, 0 <= t <= horizon, at distance d beyond the person's radius, costs
    cost · (1 - fade · t / horizon) · exp(-d² / (2 · spread²)). The cost is never lethal: the
    obstacle layer marks the person's current position. Constant velocity
    prediction as in Schöller et al., "What the constant velocity model can teach us", RA-L 2020.
    """

    needs = ("lidar or camera or depth_camera",)

    @dataclass(frozen=True)
    class Parameters:
        """Shape and height of the cost around people."""

        horizon: float = parameter(2.0, "s", at_least=0.0, at_most=10.0, help="prediction time")
        cost: int = parameter(
            200, at_least=1, at_most=252, public=True, help="cost at a person's current position"
        )

    inflated: ClassVar[bool] = False
    parameters: Parameters

    @staticmethod
    def kernels() -> KernelTypes:
        from stack.costmap.layers import kernels

        return kernels.SOCIAL

    def __init__(self, parameters: Parameters, footprint: Footprint) -> None:
        super().__init__(parameters, footprint)
        from stack.costmap.layers import kernels

        self._kernels: Any = kernels
        self._time = 0.0
        self._tracks: tuple[TrackedObject, ...] = ()

    def update(self, update: LayerUpdate) -> Box:
        """Replace the tracks by the new ones."""
        if update.tracks is None:
            return NO_BOX
        before = [self._box(track) for track in self._tracks]
        self._time, self._tracks = update.time, update.tracks
        return joined([*before, *map(self._box, self._tracks)])

    def paint(self, canvas: Canvas) -> None:
        """Raise the cost of cells that are known and below INSCRIBED_COST."""
        for track in self._tracks:
            box, cells = canvas.within(self._box(track))
            if is_some(box):
                self._raise(cells, track, box)

    def clear(self, region: Region | None) -> Box:
        """Drop all tracks until the next update."""
        boxes = [self._box(track) for track in self._tracks]
        self._tracks = ()
        return joined(boxes)

    def _raise(self, cells: Costs, track: TrackedObject, box: Box) -> None:
        """Paint one person's predicted motion on the cells of a box."""
        settings, frame = self.parameters, self.frame
        self._kernels.raise_along_motion(
            cells, frame.origin[0] + box[2] * frame.resolution,
            frame.origin[1] + box[0] * frame.resolution, frame.resolution,
            *track.position_after(self._time - track.stamp), *track.velocity,
            settings.horizon, track.radius, _WIDEST * SIDE_DEVIATION,
            float(settings.cost), FADE_AT_HORIZON, SIDE_DEVIATION,
        )  # fmt: skip

    def _box(self, track: TrackedObject) -> Box:
        """The cells whose cost a person's predicted motion raises."""
        margin = track.radius + _WIDEST * SIDE_DEVIATION
        age = self._time - track.stamp
        ends = (track.position_after(age), track.position_after(age + self.parameters.horizon))
        (x, y), (other_x, other_y) = ends
        low = min(x, other_x) - margin, min(y, other_y) - margin
        high = max(x, other_x) + margin, max(y, other_y) + margin
        return self.frame.box_around(low, high)
