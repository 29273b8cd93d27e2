"""Layered costmap: combines the map, sensor data and zones into one cost per cell.

Layers and cost values follow Nav2's costmap_2d (Lu, Hershberger and Smart, "Layered costmaps for
context-sensitive navigation", IROS 2014).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.costmap.choosing import LayerChoice, usual_layers
from stack.costmap.closing_zones import zones_between
from stack.costmap.grid_copies import GridCopies, GridCopy
from stack.costmap.inflation import Inflation
from stack.costmap.layer import (
    Box,
    CellProvenance,
    Frame,
    Layer,
    LayerUpdate,
    Region,
    is_some,
    joined,
)
from stack.costmap.layer_compositor import LayerCompositor
from stack.costmap.layers.denoise_layer import DenoiseLayer
from stack.costmap.parameters import CostmapParameters, InflationParameters
from stack.errors import ParameterError
from stack.parameters import suggestion
from stack.types import LETHAL_COST, CostGrid, Footprint, OccupancyGrid, Pose2D


class Costmap:
    """Cost of driving through each cell, updated from the sensors.

    Layers with `inflated` mark cells, in the order of the list. The marks are inflated, then the
    other layers add their costs. An update repaints and inflates only changed cells.

    Args:
        parameters: of the costmap, its inflation and its default layers.
        footprint: gives the inscribed radius and the cells under the robot.
        static: the map, or None.
        window: None to cover the map (global costmap); the side in metres of a square that rolls
            with the robot, aligned to the map's cells (local costmap).
        layers: in painting order; None for the map and obstacles.

    Raises:
        ParameterError: neither a map nor a window, or a window of less than three cells.
        InputError: a layer cannot be created, or its mask cannot be read.
    """

    @staticmethod
    def kernels(parameters: CostmapParameters, layers: Sequence[LayerChoice]) -> KernelTypes:
        """Return the kernels of a costmap with these layers."""
        from stack.costmap import kernels

        denoising = DenoiseLayer.kernels() if parameters.denoise else ()
        own = (*kernels.INFLATION, *denoising)
        return (*own, *(kernel for layer in layers for kernel in layer.component.kernels()))

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
        self._marking = [self._layers[item.name] for item in self._choices if item.is_inflated]
        adding = [self._layers[item.name] for item in self._choices if not item.is_inflated]
        self._denoise = DenoiseLayer(DenoiseLayer.Parameters(), footprint)
        self._inflation = Inflation(self._inflation_parameters(), footprint)
        self._painting = LayerCompositor(self._marking_layers(), self._inflation, adding)
        self._adding = adding
        self._radius = footprint.inscribed_radius
        self._grid: CostGrid | None = None
        self._copies = GridCopies()
        self._shown: tuple[int, GridCopy] | None = None
        self._alignment = CellAlignment(static, window, parameters.resolution, _corner(window))
        self._frame = self._alignment.frame
        self._begin(static, None)

    @property
    def parameters(self) -> CostmapParameters:
        """Current parameters."""
        return self._parameters

    @property
    def version(self) -> int:
        """Increases with each change of the cells or of the window's position."""
        return self._copies.version

    @property
    def grid(self) -> CostGrid:
        """A copy of the current costs; UNKNOWN_COST where unknown."""
        if self._grid is None:
            view = self.view
            self._grid = CostGrid(view.cells.copy(), view.resolution, view.origin)
        return self._grid

    @property
    def marks(self) -> CostGrid:
        """Free, lethal and unknown cells before inflation, without a copy: read them at once."""
        view = self.view
        return CostGrid(self._painting.marks, view.resolution, view.origin)

    @property
    def ground(self) -> CostGrid:
        """Costs of the map alone, without a copy; unknown without a map."""
        view = self.view
        cells = self._painting.ground(self._frame.everywhere)
        return CostGrid(cells, view.resolution, view.origin)

    @property
    def shown(self) -> CostGrid:
        """The current costs for displays: a copy that the first call after a change renews.

        Only what changed is copied, in place where possible: on a large map `grid` takes
        milliseconds.
        """
        if self._shown is None or self._shown[0] != self.version:
            if self._shown is not None:
                self._shown[1].release()
            self._shown = self.version, self.copied()
        return self._shown[1].grid

    @property
    def changes(self) -> tuple[tuple[int, Box], ...]:
        """The last changes, oldest first: version after the change, and the changed cells."""
        return tuple(self._copies.changes)

    @property
    def view(self) -> CostGrid:
        """The current costs without a copy, which the next update changes: read them at once."""
        return CostGrid(self._painting.cells, self._frame.resolution, self._frame.origin)

    def copied(self) -> GridCopy:
        """Return a copy for another thread; only what changed since its last use is copied."""
        return self._copies.take(self.view)

    @property
    def layers(self) -> tuple[str, ...]:
        """Names of the layers, in painting order."""
        return tuple(self._layers)

    @property
    def needs_detections(self) -> bool:
        """Whether a layer uses detections in pictures."""
        return any(layer.needs_detections for layer in self._layers.values())

    def update(self, update: LayerUpdate) -> None:
        """Add new sensor data, expire old marks and roll the window to the robot."""
        self._follow(update.pose)
        marked = joined([layer.update(update) for layer in self._painting.marking])
        added = joined([layer.update(update) for layer in self._adding])
        self._repaint(marked, added)

    def explain(self, x: float, y: float) -> CellProvenance | None:
        """Return the layer, source and time that made a cell lethal; None if it is not lethal.

        When several layers mark the cell, the first in the list is returned.

        Args:
            x: metres, map frame.
            y: metres, map frame.
        """
        view = self.view
        row, column = view.cell_at(x, y)
        if not view.contains(row, column) or self._painting.cells[row, column] != LETHAL_COST:
            return None
        for name, layer in self._layers.items():
            origin = layer.origin_of(row, column)
            if origin is not None:
                return CellProvenance(name, *origin)
        return None

    @property
    def way_out(self) -> Pose2D | None:
        """First place outside, map frame, for a robot in a keep-out zone; None elsewhere."""
        return next((layer.way_out for layer in self._layers.values() if layer.way_out), None)

    @property
    def forbidden(self) -> dict[str, NDArray[np.bool_]]:
        """Cells (rows, columns) of each keep-out zone, by name."""
        zones: dict[str, NDArray[np.bool_]] = {}
        for layer in self._layers.values():
            for name, cells in layer.forbidden().items():
                zones[name] = cells | zones.get(name, False)
        return zones

    def zones_between(self, start: Pose2D, goal: Pose2D) -> tuple[str, ...]:
        """Return the names of the keep-out zones that alone close the way between two places."""
        zones = self.forbidden
        if not zones:
            return ()
        return zones_between(self.view, self.ground.cells, zones, (start, goal), self._radius)

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
        self._alignment = CellAlignment(static, self._window, before.resolution, before.origin)
        self._frame = self._alignment.frame
        column, row = (
            round((new - old) / before.resolution)
            for new, old in zip(self._frame.origin, before.origin, strict=True)
        )
        self._begin(static, (row, column))

    def configure(self, parameters: CostmapParameters) -> None:
        """Apply new parameters; the cells and sensed obstacles stay.

        Raises:
            ParameterError: the size of the local costmap changed.
        """
        if parameters.local_size != self._parameters.local_size:
            raise ParameterError("local_size", "cannot be changed during a run")
        settings = {item.name: item.parameters(parameters) for item in self._choices}
        for name, values in settings.items():
            self._layers[name].configure(values)
        self._parameters = parameters
        self._inflation.configure(self._inflation_parameters())
        self._painting.mark_with(self._marking_layers())
        self._recompute()

    def _inflation_parameters(self) -> InflationParameters:
        return self._parameters.inflation(local=self._window is not None)

    def _marking_layers(self) -> list[Layer]:
        """Return the layers whose marks are inflated, in order."""
        return [*self._marking, self._denoise] if self._parameters.denoise else self._marking

    def _begin(self, static: OccupancyGrid | None, shift: tuple[int, int] | None) -> None:
        """Lay out every layer in the current frame and repaint all cells."""
        for layer in self._layers.values():
            layer.set_map(static)
            layer.lay_out(self._frame, shift)
        self._painting.lay_out(self._frame)
        self._recompute()

    def _follow(self, pose: Pose2D) -> None:
        """Roll the window with the robot; cells that stay inside keep their values."""
        shift = self._alignment.follow(pose)
        if shift == (0, 0):
            return
        self._frame = self._alignment.frame
        for layer in self._layers.values():
            layer.lay_out(self._frame, shift)
        self._painting.move(self._frame, shift)

    def _clear(self, region: Region | None, name: str | None) -> None:
        if name is not None and name not in self._layers:
            raise ParameterError("layer", f"unknown layer {name!r}", suggestion(name, self._layers))
        names = self._layers if name is None else (name,)
        boxes = {key: self._layers[key].clear(region) for key in names}
        adding = {item.name for item in self._choices if not item.is_inflated}
        self._repaint(
            joined([box for key, box in boxes.items() if key not in adding]),
            joined([box for key, box in boxes.items() if key in adding]),
        )

    def _recompute(self) -> None:
        self._painting.repaint_all()
        self._copies.renew()
        self._grid = None

    def _repaint(self, marked: Box, added: Box) -> None:
        changed = self._painting.repaint(marked, added)
        if is_some(changed):
            self._copies.note(changed)
            self._grid = None


def _corner(window: float | None) -> tuple[float, float]:
    """Lower left corner of a window centred on the origin of the map frame."""
    return (0.0, 0.0) if window is None else (-window / 2, -window / 2)


class CellAlignment:
    """Aligns a costmap's cells to those of the map, or to multiples of the resolution.

    Args:
        static: the map, or None.
        window: side of a rolling square in metres, or None to cover the map.
        resolution: side of a window's cells, metres; without a window the map's is used.
        near: (x, y) wanted for the window's corner, metres; rounded to a cell.

    Raises:
        ParameterError: neither a map nor a window, or a window of less than three cells.
    """

    def __init__(
        self, static: OccupancyGrid | None, window: float | None, resolution: float,
        near: tuple[float, float],
    ) -> None:  # fmt: skip
        self._rolls = window is not None
        self._start = (0.0, 0.0) if static is None else static.origin
        if window is not None:
            self._resolution = resolution
            side = round(window / resolution)
            if side < 3:
                raise ParameterError(
                    "window", f"{window:g} m is less than three cells of {resolution:g} m"
                )
            self._shape = (side, side)
            self._corner = self._corner_near(*near)
        elif static is not None:
            rows, columns = static.cells.shape
            self._resolution, self._shape, self._corner = static.resolution, (rows, columns), (0, 0)
        else:
            raise ParameterError("window", "a costmap without a map needs a window, e.g. 5 m")

    @property
    def frame(self) -> Frame:
        """Current position of the cells."""
        (row, column), (x, y), step = self._corner, self._start, self._resolution
        return Frame(self._shape, step, (x + column * step, y + row * step))

    def follow(self, pose: Pose2D) -> tuple[int, int]:
        """Centre the window on the robot; return the rows and columns by which it moved."""
        if not self._rolls:
            return 0, 0
        half = self._shape[0] * self._resolution / 2
        row, column = self._corner
        self._corner = self._corner_near(pose.x - half, pose.y - half)
        return self._corner[0] - row, self._corner[1] - column

    def _corner_near(self, x: float, y: float) -> tuple[int, int]:
        """Row and column of the cell corner nearest to a point, metres."""
        left, low = self._start
        return round((y - low) / self._resolution), round((x - left) / self._resolution)
