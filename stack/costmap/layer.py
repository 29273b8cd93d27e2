"""Base class of costmap layers, and the data passed between a layer and its costmap."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import ceil, floor
from typing import Any, ClassVar, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from stack.compilation import KernelTypes
from stack.types import (
    Detection,
    FloatArray,
    Footprint,
    OccupancyGrid,
    Pose2D,
    RangeReading,
    Scan,
    TrackedObject,
)

Costs = NDArray[np.uint8]
M = TypeVar("M")
Box = tuple[int, int, int, int]
"""First row, last row + 1, first column, last column + 1; empty if a pair does not increase."""
NO_BOX: Box = (0, 0, 0, 0)

ALIGNED_WITHIN = 0.01
"""Share of a cell by which grids of equal resolution may be shifted and still have equal cells."""


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

    def cell_at(self, pose: Pose2D) -> tuple[int, int]:
        """(row, column) of the cell at a position; may be outside the costmap."""
        (x, y), step = self.origin, self.resolution
        return floor((pose.y - y) / step), floor((pose.x - x) / step)

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
class Posed(Generic[M]):
    """A measurement, and the pose of the base at its stamp, map frame."""

    measurement: M
    pose: Pose2D


@dataclass(frozen=True, slots=True)
class LayerUpdate:
    """Sensor data that is new since the last update.

    Attributes:
        pose: of the base at `time`, map frame.
        time: seconds on the robot's clock.
        scans: new scans by the name of their sensor.
        readings: new range readings, e.g. of sonars.
        tracks: all tracked objects, at `time`; None when they were not updated.
        depth: (n, 2) all obstacles of the depth cameras, map frame; None when nothing changed.
        detections: objects in a new picture; None without one.
    """

    pose: Pose2D
    time: float
    scans: Mapping[str, Posed[Scan]] = field(default_factory=dict)
    readings: tuple[Posed[RangeReading], ...] = ()
    tracks: tuple[TrackedObject, ...] | None = None
    depth: FloatArray | None = None
    detections: tuple[Detection, ...] | None = None


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

    def within(self, box: Box) -> tuple[Box, Costs]:
        """Return the part of a box on the canvas, and the cells there."""
        inside, (row, _, column, _) = common(box, self.box), self.box
        if not is_some(inside):
            return NO_BOX, self.cells[:0, :0]
        top, bottom, left, right = inside
        return inside, self.cells[top - row : bottom - row, left - column : right - column]


@dataclass(frozen=True)
class NoParameters:
    """No parameters."""


class Layer(ABC):
    """Base class of costmap layers: one source of costs, e.g. the map, a sensor or a zone.

    A layer stores its own data and paints it on request; only `paint` is required. `Parameters` is
    a frozen dataclass of `parameter(...)` fields. Import kernels in `__init__`, so that checking a
    mission imports none.

    Attributes:
        parameters: current parameters, an instance of `Parameters`.
        footprint: of the robot.
        frame: current position and size of the cells.
        map: the map, or None.
        inflated: whether the layer's lethal cells are inflated; an entry in a mission's list may
            set it otherwise. Layers that are not inflated are painted over the inflated costs.
        needs: sensors that the robot must have, as for other components.
        needs_detections: whether the layer uses detections in pictures.
    """

    Parameters: ClassVar[type] = NoParameters
    inflated: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ()
    needs_detections: ClassVar[bool] = False

    def __init__(self, parameters: Any, footprint: Footprint) -> None:
        self.parameters: Any = parameters
        self.footprint = footprint
        self.frame = Frame((0, 0), 1.0, (0.0, 0.0))
        self.map: OccupancyGrid | None = None

    @staticmethod
    def kernels() -> KernelTypes:
        """Return the numba functions that the layer calls, with the types of their arguments.

        They are compiled before the first step; others are when the run first calls them.
        """
        return ()

    @staticmethod
    def lidars(parameters: Any) -> tuple[str, ...]:
        """Return the names of the lidars whose scans a layer with these parameters reads."""
        return ()

    @abstractmethod
    def paint(self, canvas: Canvas) -> None:
        """Paint this layer's cells over those of the layers before it."""

    @property
    def reach(self) -> int:
        """Largest distance in cells at which one cell affects another."""
        return 0

    def configure(self, parameters: Any) -> None:
        """Apply new parameters; the costmap repaints all cells afterwards."""
        self.parameters = parameters

    def set_map(self, grid: OccupancyGrid | None) -> None:
        """Use another map, or none; `lay_out` is called afterwards."""
        self.map = grid

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Change the position or the size of the cells.

        Args:
            frame: the new geometry.
            shift: (rows, columns) from the old cell (0, 0) to the new one, so that sensed cells
                keep their positions; None to start without sensed cells.
        """
        self.frame = frame

    def update(self, update: LayerUpdate) -> Box:
        """Process new sensor data; return the box of the cells to repaint."""
        return NO_BOX

    def clear(self, region: Region | None) -> Box:
        """Clear sensed cells in a region, None for everywhere; return the box to repaint."""
        return NO_BOX

    def ground(self, box: Box) -> Costs | None:
        """Costs of the map alone in a box; None if the layer does not hold the map."""
        return None

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Source and time of this layer's lethal mark in a cell; None without a mark."""
        return None

    def forbidden(self) -> dict[str, NDArray[np.bool_]]:
        """Cells (rows, columns) that are closed by a rule, not by an obstacle, by zone name."""
        return {}

    @property
    def way_out(self) -> Pose2D | None:
        """First place outside, map frame, for a robot in a forbidden area; None elsewhere."""
        return None


def is_some(box: Box) -> bool:
    """Whether a box contains any cell."""
    return box[0] < box[1] and box[2] < box[3]


def joined(boxes: Iterable[Box]) -> Box:
    """The smallest box that contains all boxes."""
    whole = NO_BOX
    for box in boxes:
        if not is_some(box):
            continue
        if whole is NO_BOX:
            whole = box
            continue
        (top, bottom, left, right), (low, high, first, last) = whole, box
        whole = min(top, low), max(bottom, high), min(left, first), max(right, last)
    return whole


def common(one: Box, other: Box) -> Box:
    """The cells of both boxes."""
    box = (
        max(one[0], other[0]), min(one[1], other[1]), max(one[2], other[2]), min(one[3], other[3])
    )  # fmt: skip
    return box if is_some(box) else NO_BOX


def moved(box: Box, shape: tuple[int, int], shift: tuple[int, int]) -> Box:
    """The part of a box that stays inside a grid of this shape after a shift, in its new cells."""
    (rows, columns), (down, right) = shape, shift
    inside = (
        max(box[0] - down, 0), min(box[1] - down, rows),
        max(box[2] - right, 0), min(box[3] - right, columns),
    )  # fmt: skip
    return inside if is_some(inside) else NO_BOX


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


def sampled(grid: OccupancyGrid, frame: Frame, box: Box, outside: int) -> NDArray[np.int8]:
    """Return the grid's values at a box's cell centres, (rows, columns); `outside` off the grid."""
    scale = frame.resolution / grid.resolution
    (x, y), (left, low) = frame.origin, grid.origin
    down, right = (y - low) / grid.resolution, (x - left) / grid.resolution
    if scale == 1.0 and max(abs(down - round(down)), abs(right - round(right))) < ALIGNED_WITHIN:
        shift = box[0] + round(down), box[2] + round(right)
        return shifted(grid.cells, (box[1] - box[0], box[3] - box[2]), shift, outside)
    row = np.floor(down + (np.arange(*box[:2]) + 0.5) * scale)
    column = np.floor(right + (np.arange(*box[2:]) + 0.5) * scale)
    return picked(grid.cells, row.astype(int), column.astype(int), outside)


def picked(
    cells: NDArray[np.int8], rows: NDArray[np.int64], columns: NDArray[np.int64], outside: int
) -> NDArray[np.int8]:
    """Return the cells at ascending rows and columns, (rows, columns); `outside` off the grid."""
    values = np.full((rows.size, columns.size), outside, dtype=np.int8)
    on_rows, rows = _within(rows, cells.shape[0])
    on_columns, columns = _within(columns, cells.shape[1])
    if rows.size and columns.size:
        near = cells[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        if near.shape == (rows.size, columns.size):  # equal cells: no indexing one by one
            values[on_rows, on_columns] = near
        else:
            values[on_rows, on_columns] = near[np.ix_(rows - rows[0], columns - columns[0])]
    return values


def _within(indices: NDArray[np.int64], size: int) -> tuple[slice, NDArray[np.int64]]:
    """Return the slice of ascending indices that are in [0, size), and these indices."""
    on = slice(int(indices.searchsorted(0)), int(indices.searchsorted(size)))
    return on, indices[on]
