"""Interface of costmap layers, and the data passed between a layer and its costmap."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import ceil, floor
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, Footprint, Pose2D, RangeReading, Scan, TrackedObject

Costs = NDArray[np.uint8]
Box = tuple[int, int, int, int]
"""First row, last row + 1, first column, last column + 1; empty if a pair does not increase."""
NO_BOX: Box = (0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class CellProvenance:
    """The layer and source that made a cell lethal.

    Attributes:
        layer: name of the layer that marked the cell.
        source: sensor, zone or map.
        time: of the source's last observation, seconds on the robot's clock; None for the map and
            zones, which do not change.
    """

    layer: str
    source: str
    time: float | None = None


@dataclass(frozen=True, slots=True)
class Frame:
    """Geometry of a costmap: (rows, columns), side of a cell and outer corner of cell (0, 0), m."""

    shape: tuple[int, int]
    resolution: float
    origin: tuple[float, float]

    @property
    def everywhere(self) -> Box:
        """The box of all cells."""
        return 0, self.shape[0], 0, self.shape[1]

    def grown(self, box: Box, by: int) -> Box:
        """A box grown by `by` cells on each side, clipped to the costmap."""
        rows, columns = self.shape
        top, bottom, left, right = box
        return max(top - by, 0), min(bottom + by, rows), max(left - by, 0), min(right + by, columns)

    def box_around(self, low: tuple[float, float], high: tuple[float, float]) -> Box:
        """The cells that touch a rectangle with these two corners, metres."""
        (x, y), step = self.origin, self.resolution
        top, bottom = floor((low[1] - y) / step), ceil((high[1] - y) / step)
        left, right = floor((low[0] - x) / step), ceil((high[0] - x) / step)
        box = max(top, 0), min(bottom, self.shape[0]), max(left, 0), min(right, self.shape[1])
        return box if is_some(box) else NO_BOX

    def middles(self, box: Box) -> tuple[FloatArray, FloatArray]:
        """x as (1, columns) and y as (rows, 1) of the centres of a box's cells, metres."""
        top, bottom, left, right = box
        x = self.origin[0] + (np.arange(left, right, dtype=np.float64) + 0.5) * self.resolution
        y = self.origin[1] + (np.arange(top, bottom, dtype=np.float64) + 0.5) * self.resolution
        return x[None, :], y[:, None]


@dataclass(frozen=True, slots=True)
class SensorUpdate:
    """Sensor data that is new since the last update.

    Attributes:
        pose: of the base, map frame.
        time: seconds on the robot's clock.
        scan: a new scan, or None.
        source: name of the sensor that took the scan.
        readings: new range readings, e.g. of sonars.
        tracks: all tracked objects, at `time`; None when they were not updated.
    """

    pose: Pose2D
    time: float
    scan: Scan | None = None
    source: str = "lidar"
    readings: tuple[RangeReading, ...] = ()
    tracks: tuple[TrackedObject, ...] | None = None


@dataclass(frozen=True, slots=True)
class Region:
    """A set of cells: a box and a mask (rows, columns) of the cells inside it."""

    box: Box
    inside: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Canvas:
    """The cells of a box, as painted by the layers so far.

    Attributes:
        cells: (rows, columns) of the box; a layer writes to it.
        ground: (rows, columns) of the box, costs of the map alone; unknown without a map.
        box: position of these cells in the costmap.
    """

    cells: Costs
    ground: Costs
    box: Box


class CostmapLayer(Protocol):
    """One source of costs, e.g. the map, a sensor or a zone.

    Layers before `inflation` in a costmap's list mark cells, which are then inflated; layers after
    it add costs that are not inflated. A layer stores its own data and paints it on request. Its
    class attribute `Parameters` is a frozen dataclass of `parameter(...)` fields; kernels are
    imported in `__init__`, so that checking a mission imports none.

    Attributes:
        reach: largest distance in cells at which one cell affects another; mostly 0.
        needs_tracks: whether the layer uses tracked objects.
    """

    needs_tracks: ClassVar[bool]

    def __init__(self, parameters: Any, footprint: Footprint) -> None: ...

    @property
    def reach(self) -> int:
        """Largest distance in cells at which one cell affects another; mostly 0."""
        ...

    def configure(self, parameters: Any) -> None:
        """Apply new parameters; the costmap repaints all cells afterwards."""
        ...

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Change the position or the size of the cells.

        Args:
            frame: the new geometry.
            shift: (rows, columns) from the old cell (0, 0) to the new one, so that sensed cells
                keep their positions; None to start without sensed cells.
        """
        ...

    def update(self, senses: SensorUpdate) -> Box:
        """Process new sensor data; return the box of the cells to repaint."""
        ...

    def paint(self, canvas: Canvas) -> None:
        """Paint this layer's cells over those of the layers before it."""
        ...

    def clear(self, region: Region | None) -> Box:
        """Clear sensed cells in a region, None for everywhere; return the box to repaint."""
        ...

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Source and time of this layer's lethal mark in a cell; None without a mark."""
        ...


@runtime_checkable
class Inflation(CostmapLayer, Protocol):
    """The layer that adds costs around lethal cells.

    Its `reach` is the inflation radius in cells.
    """

    def spread(self, cells: Costs, base: Costs, box: Box) -> None:
        """Inflate a box of `base` into `cells` (both cover the whole costmap)."""
        ...


def is_some(box: Box) -> bool:
    """Whether a box contains any cell."""
    return box[0] < box[1] and box[2] < box[3]


def joined(boxes: Iterable[Box]) -> Box:
    """The smallest box that contains all boxes."""
    some = [box for box in boxes if is_some(box)]
    if not some:
        return NO_BOX
    tops, bottoms, lefts, rights = zip(*some, strict=True)
    return min(tops), max(bottoms), min(lefts), max(rights)


def part(cells: NDArray[Any], box: Box) -> NDArray[Any]:
    """A view of the cells of a box."""
    top, bottom, left, right = box
    return cells[top:bottom, left:right]


def shifted(
    source: NDArray[Any], shape: tuple[int, int], shift: tuple[int, int], fill: float
) -> NDArray[Any]:
    """Copy cells to a new shape; cell (0, 0) is the source's cell `shift`, new cells are `fill`."""
    target = np.full(shape, fill, dtype=source.dtype)
    row, column = shift
    rows = min(shape[0], source.shape[0] - row) - max(0, -row)
    columns = min(shape[1], source.shape[1] - column) - max(0, -column)
    if rows > 0 and columns > 0:
        to_row, to_column = max(0, -row), max(0, -column)
        from_row, from_column = max(0, row), max(0, column)
        target[to_row : to_row + rows, to_column : to_column + columns] = source[
            from_row : from_row + rows, from_column : from_column + columns
        ]
    return target


def edges(shape: tuple[int, int], shift: tuple[int, int], *, lead: int, trail: int) -> list[Box]:
    """Strips along the edges of a grid that was shifted.

    Args:
        shape: (rows, columns).
        shift: (rows, columns) by which the grid moved.
        lead: width in cells added to the new cells at the leading edges.
        trail: width in cells at the trailing edges.
    """
    rows, columns = shape
    strips: list[Box] = []
    for length, by, across in ((rows, shift[0], False), (columns, shift[1], True)):
        if by == 0:
            continue
        new, old = min(abs(by) + lead, length), min(trail, length)
        first = (length - new, length, 0, old) if by > 0 else (0, new, length - old, length)
        for start, end in (first[:2], first[2:]):
            strips.append((0, rows, start, end) if across else (start, end, 0, columns))
    return [strip for strip in strips if is_some(strip)]
