"""Layered costmap: combines the map, sensor data and zones into one cost per cell.

Layers and cost values follow Nav2's costmap_2d (Lu, Hershberger and Smart, "Layered costmaps for
context-sensitive navigation", IROS 2014).
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

import numpy as np

from stack.costmap.choosing import LayerChoice, usual_layers
from stack.costmap.denoise_layer import DenoiseLayer
from stack.costmap.lattice import Lattice
from stack.costmap.layer import (
    Box,
    CellProvenance,
    CostmapLayer,
    Inflation,
    Region,
    SensorUpdate,
    joined,
)
from stack.costmap.layer_compositor import LayerCompositor
from stack.costmap.parameters import CostmapParameters
from stack.costmap.static_layer import StaticLayer
from stack.costmap.zone_layers import SpeedZonesLayer
from stack.errors import ParameterError
from stack.parameters import suggestion
from stack.types import (
    LETHAL_COST,
    CostGrid,
    Footprint,
    OccupancyGrid,
    Pose2D,
    RangeReading,
    Scan,
    TrackedObject,
)


class Costmap:
    """Cost of driving through each cell, updated from the sensors.

    Layers before `inflation` mark cells, which are inflated; layers after it add costs. An update
    repaints and inflates only changed cells.

    Args:
        parameters: of the costmap and its default layers.
        footprint: gives the inscribed radius and the cells under the robot.
        static: the map, or None.
        window: None to cover the map (global costmap); the side in metres of a square that rolls
            with the robot, aligned to the map's cells (local costmap).
        layers: in painting order; None for the map, obstacles and inflation.

    Raises:
        ParameterError: neither a map nor a window, or a window of less than three cells.
        InputError: a layer's mask cannot be read.
    """

    def __init__(
        self,
        parameters: CostmapParameters,
        footprint: Footprint,
        static: OccupancyGrid | None,
        *,
        window: float | None = None,
        layers: Sequence[LayerChoice] | None = None,
    ) -> None:
        self._parameters, self._window = parameters, window
        self._choices = tuple(usual_layers() if layers is None else layers)
        self._layers = {item.name: item.made(parameters, footprint) for item in self._choices}
        self._denoise = DenoiseLayer(DenoiseLayer.Parameters(), footprint)
        order = list(self._layers.values())
        self._inflation = next((layer for layer in order if isinstance(layer, Inflation)), None)
        self._pivot = len(order) if self._inflation is None else order.index(self._inflation)
        self._adding = order[self._pivot + 1 :]
        self._painting = LayerCompositor(self._marking(), self._inflation, self._adding)
        self._version = 0
        self._grid: CostGrid | None = None
        self._lattice = Lattice(static, window, parameters.resolution, _corner(window))
        self._frame = self._lattice.frame
        self._begin(static, None)

    @property
    def parameters(self) -> CostmapParameters:
        """Current parameters."""
        return self._parameters

    @property
    def version(self) -> int:
        """Increases with each change of the cells or of the window's position."""
        return self._version

    @property
    def grid(self) -> CostGrid:
        """A copy of the current costs; UNKNOWN_COST where unknown."""
        if self._grid is None:
            self._grid = CostGrid(
                self._painting.cells.copy(), self._frame.resolution, self._frame.origin
            )
        return self._grid

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the layers, in painting order."""
        return tuple(self._layers)

    @property
    def needs_tracks(self) -> bool:
        """Whether a layer uses tracked objects."""
        return any(layer.needs_tracks for layer in self._layers.values())

    def update(
        self, pose: Pose2D, scan: Scan | None, time: float, *,
        readings: Sequence[RangeReading] = (), tracks: Sequence[TrackedObject] | None = None,
    ) -> None:  # fmt: skip
        """Add new sensor data, expire old marks and roll the window to the robot.

        Args:
            pose: of the base when the scan was taken, map frame.
            scan: a new scan, or None.
            time: seconds on the robot's clock.
            readings: new range readings, e.g. of sonars.
            tracks: all tracked objects, map frame; None when they were not updated.
        """
        known = None if tracks is None else tuple(tracks)
        self._take_in(SensorUpdate(pose, time, scan, "lidar", tuple(readings), known))

    def update_from(self, source: str, pose: Pose2D, scan: Scan, time: float) -> None:
        """Add a scan of another lidar, for the obstacle layer with that `source`."""
        self._take_in(SensorUpdate(pose, time, scan, source))

    def explain(self, x: float, y: float) -> CellProvenance | None:
        """Return the layer, source and time that made a cell lethal; None if it is not lethal.

        When several layers mark the cell, the first in the list is returned.

        Args:
            x: metres, map frame.
            y: metres, map frame.
        """
        row, column = self.grid.cell_at(x, y)
        if not self.grid.contains(row, column) or self._painting.cells[row, column] != LETHAL_COST:
            return None
        for name, layer in self._layers.items():
            origin = layer.origin_of(row, column)
            if origin is not None:
                return CellProvenance(name, *origin)
        return None

    def clear(self, *, layer: str | None = None) -> None:
        """Clear sensed obstacles everywhere, in one layer or all. The map and zones stay.

        Raises:
            ParameterError: there is no such layer.
        """
        self._clear(None, layer)

    def clear_around(self, pose: Pose2D, radius: float, *, layer: str | None = None) -> None:
        """Clear sensed obstacles within `radius` metres of a pose; otherwise as `clear`."""
        low, high = (pose.x - radius, pose.y - radius), (pose.x + radius, pose.y + radius)
        box = self._frame.box_around(low, high)
        x, y = self._frame.middles(box)
        self._clear(Region(box, np.hypot(x - pose.x, y - pose.y) <= radius), layer)

    def speed_limit(self, pose: Pose2D, deceleration: float) -> float:
        """Speed limit of the speed zones here and ahead, m/s; inf without. See SpeedZonesLayer."""
        limits = (
            layer.speed_limit(pose, deceleration)
            for layer in self._layers.values()
            if isinstance(layer, SpeedZonesLayer)
        )
        return min(limits, default=inf)

    def set_static(self, static: OccupancyGrid) -> None:
        """Replace the map, e.g. by a new one from SLAM; sensed obstacles keep their positions.

        Raises:
            ParameterError: the resolution of the map changed.
        """
        before = self._frame
        if self._window is None and static.resolution != before.resolution:
            raise ParameterError(
                "static",
                f"resolution {static.resolution:g} m, expected {before.resolution:g} m, "
                "the resolution of the previous map",
            )
        self._lattice = Lattice(static, self._window, before.resolution, before.origin)
        self._frame = self._lattice.frame
        column, row = (
            round((new - old) / before.resolution)
            for new, old in zip(self._frame.origin, before.origin, strict=True)
        )
        self._begin(static, (row, column))

    def configure(self, parameters: CostmapParameters) -> None:
        """Apply new parameters; the cells and sensed obstacles stay."""
        settings = {item.name: item.parameters(parameters) for item in self._choices}
        for name, values in settings.items():
            self._layers[name].configure(values)
        self._parameters = parameters
        self._painting.marking = self._marking()
        self._recompute()

    def _marking(self) -> list[CostmapLayer]:
        """Return the layers whose marks are inflated, in order."""
        layers = list(self._layers.values())
        marking = layers[: self._pivot]
        if self._parameters.denoise and not any(isinstance(x, DenoiseLayer) for x in marking):
            marking.append(self._denoise)
        return marking

    def _begin(self, static: OccupancyGrid | None, shift: tuple[int, int] | None) -> None:
        """Lay out every layer in the current frame and repaint all cells."""
        for layer in self._layers.values():
            if isinstance(layer, StaticLayer):
                layer.take(static)
                layer.lay_out(self._frame, None)
            else:
                layer.lay_out(self._frame, shift)
        self._painting.lay_out(self._frame)
        self._recompute()

    def _take_in(self, senses: SensorUpdate) -> None:
        self._follow(senses.pose)
        marked = joined([layer.update(senses) for layer in self._painting.marking])
        added = joined([layer.update(senses) for layer in self._adding])
        self._repaint(marked, added)

    def _follow(self, pose: Pose2D) -> None:
        """Roll the window with the robot; cells that stay inside keep their values."""
        shift = self._lattice.follow(pose)
        if shift == (0, 0):
            return
        self._frame = self._lattice.frame
        for layer in self._layers.values():
            layer.lay_out(self._frame, shift)
        self._painting.move(self._frame, shift)

    def _clear(self, region: Region | None, name: str | None) -> None:
        if name is not None and name not in self._layers:
            raise ParameterError("layer", f"unknown layer {name!r}", suggestion(name, self._layers))
        names = self._layers if name is None else (name,)
        order = list(self._layers)
        boxes = {key: self._layers[key].clear(region) for key in names}
        self._repaint(
            joined([box for key, box in boxes.items() if order.index(key) < self._pivot]),
            joined([box for key, box in boxes.items() if order.index(key) > self._pivot]),
        )

    def _recompute(self) -> None:
        self._painting.repaint_all()
        self._grid = None
        self._version += 1

    def _repaint(self, marked: Box, added: Box) -> None:
        if self._painting.repaint(marked, added):
            self._grid = None
            self._version += 1


def _corner(window: float | None) -> tuple[float, float]:
    """Lower left corner of a window centred on the origin of the map frame."""
    return (0.0, 0.0) if window is None else (-window / 2, -window / 2)
