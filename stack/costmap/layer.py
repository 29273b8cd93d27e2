"""What a costmap layer is, and what passes between it and its costmap."""

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
"""First row, last row + 1, first column, last column + 1; empty if the first pair is not rising."""
NO_BOX: Box = (0, 0, 0, 0)


@dataclass(frozen=True, slots=True)
class CellProvenance:
    """Why a cell is lethal.

    Attributes:
        layer: name of the layer that marked it.
        source: sensor, zone or map that it had it from.
        time: when that source last said so, seconds on the robot's clock; None for what always is.
    """

    layer: str
    source: str
    time: float | None = None


@dataclass(frozen=True, slots=True)
class Frame:
    """Where a costmap's cells lie: (rows, columns), side in metres, outer corner of cell (0, 0)."""

    shape: tuple[int, int]
    resolution: float
    origin: tuple[float, float]

    @property
    def everywhere(self) -> Box:
        """All cells."""
        return 0, self.shape[0], 0, self.shape[1]

    def grown(self, box: Box, by: int) -> Box:
        """A box and `by` cells around it, as far as there are cells."""
        rows, columns = self.shape
        top, bottom, left, right = box
        return max(top - by, 0), min(bottom + by, rows), max(left - by, 0), min(right + by, columns)

    def box_around(self, low: tuple[float, float], high: tuple[float, float]) -> Box:
        """The cells that touch a rectangle given by two corners, metres."""
        (x, y), step = self.origin, self.resolution
        top, bottom = floor((low[1] - y) / step), ceil((high[1] - y) / step)
        left, right = floor((low[0] - x) / step), ceil((high[0] - x) / step)
        box = max(top, 0), min(bottom, self.shape[0]), max(left, 0), min(right, self.shape[1])
        return box if is_some(box) else NO_BOX

    def middles(self, box: Box) -> tuple[FloatArray, FloatArray]:
        """x as (1, columns) and y as (rows, 1) of the middles of a box's cells, metres."""
        top, bottom, left, right = box
        x = self.origin[0] + (np.arange(left, right, dtype=np.float64) + 0.5) * self.resolution
        y = self.origin[1] + (np.arange(top, bottom, dtype=np.float64) + 0.5) * self.resolution
        return x[None, :], y[:, None]


@dataclass(frozen=True, slots=True)
class SensorUpdate:
    """What is new since the last update.

    Attributes:
        pose: of the base, map frame.
        time: seconds on the robot's clock.
        scan: a new scan, or None.
        source: the sensor that the scan is from.
        readings: new ones of sonar-like sensors.
        tracks: of everything that moves, now; None without news of them.
    """

    pose: Pose2D
    time: float
    scan: Scan | None = None
    source: str = "lidar"
    readings: tuple[RangeReading, ...] = ()
    tracks: tuple[TrackedObject, ...] | None = None


@dataclass(frozen=True, slots=True)
class Region:
    """Some cells: a box, and which of its cells, (rows, columns) of the box."""

    box: Box
    inside: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Canvas:
    """The cells of a box, as the layers so far have painted them.

    Attributes:
        cells: (rows, columns) of the box, to be painted on.
        ground: likewise, what the map alone says; unknown without one.
        box: which cells of the costmap these are.
    """

    cells: Costs
    ground: Costs
    box: Box


class CostmapLayer(Protocol):
    """One reason why places cost something.

    Layers before `inflation` in a costmap's list mark what is then inflated; those after it add
    costs that are not. A layer keeps what it knows and paints it when asked to. Its class attribute
    `Parameters` is a frozen dataclass of `parameter(...)` fields; kernels are imported in
    `__init__`, so that checking a mission imports none.

    Attributes:
        reach: how many cells away a cell may decide what another one is painted; mostly 0.
        needs_tracks: whether somebody has to follow moving things for it.
    """

    needs_tracks: ClassVar[bool]

    def __init__(self, parameters: Any, footprint: Footprint) -> None: ...

    @property
    def reach(self) -> int:
        """How many cells away a cell may decide what another one is painted; mostly 0."""
        ...

    def configure(self, parameters: Any) -> None:
        """Use other settings from now on; everything is painted anew after it."""
        ...

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """The cells lie elsewhere from now on.

        Args:
            frame: where.
            shift: (rows, columns) by which new cell (0, 0) lies beyond the old one, so that what
                was sensed can be kept; None to begin without.
        """
        ...

    def update(self, senses: SensorUpdate) -> Box:
        """Take in what is new; returns the box of the cells that are to be painted anew."""
        ...

    def paint(self, canvas: Canvas) -> None:
        """Put what this layer knows over what the ones before it painted."""
        ...

    def clear(self, region: Region | None) -> Box:
        """Forget what was sensed in a region or everywhere; returns what is to be painted anew."""
        ...

    def origin_of(self, row: int, column: int) -> tuple[str, float | None] | None:
        """Source and time of this layer's own lethal mark in a cell; None when it has none."""
        ...


@runtime_checkable
class Inflation(CostmapLayer, Protocol):
    """The layer between marks and costs: what lies near lethal cells costs, too.

    Its `reach` is how many cells away from a lethal cell the cost ends.
    """

    def spread(self, cells: Costs, base: Costs, box: Box) -> None:
        """Write a box of cells from base (both the whole costmap) and what surrounds it."""
        ...


def is_some(box: Box) -> bool:
    """Whether a box holds any cell."""
    return box[0] < box[1] and box[2] < box[3]


def joined(boxes: Iterable[Box]) -> Box:
    """The smallest box around all."""
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
    """Cells of another shape whose cell (0, 0) lies over the source's cell `shift`."""
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
    """Strips along the edges of cells of one shape that were shifted over each other.

    Args:
        shape: (rows, columns).
        shift: (rows, columns) by which they moved.
        lead: cells of width beyond what came in at the leading edges.
        trail: cells of width at the trailing edges, where others went out.
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
