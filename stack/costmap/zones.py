"""Floor zones from polygons or a mask, and the costmap cells inside them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import NO_BOX, Box, Frame, common, edges, is_some, part, sampled, shifted
from stack.errors import InputError, ParameterError
from stack.geometry.polygons import distances_to_edges, points_inside
from stack.parameters import Declaration, build, parameter
from stack.types import FREE, FloatArray, OccupancyGrid, Pose2D

Corners = tuple[tuple[float, float], ...]
_METRES = Declaration("corners", float, unit="m")
IN_MASK = 255

CELL_DIAGONAL = 1.4
"""Diagonal of a cell, in sides: half of it for the edge of a zone, and half for a robot that is
anywhere in its cell."""

ZONE_MARGIN = CELL_DIAGONAL * 0.05
"""Metres by which zones that the robot must not enter are drawn larger: the diagonal of a cell of
5 cm, in costmaps with finer cells too, so that all agree."""


@dataclass(frozen=True)
class Zone:
    """A polygon on the floor, map frame."""

    corners: tuple[Any, ...] = parameter((), help="at least three [x, y] in metres, map frame")
    name: str = parameter("", help="name for messages")

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", read_corners(self.corners))

    def __str__(self) -> str:
        return self.name

    @property
    def points(self) -> FloatArray:
        """(n, 2) corners, metres."""
        return np.array(self.corners, dtype=np.float64)


ZoneKind = TypeVar("ZoneKind", bound=Zone)


def read_corners(raw: Any) -> Corners:
    """Read the corners of a polygon from a file value.

    Raises:
        ParameterError: fewer than three corners, or a corner that is not [x, y].
    """
    if not isinstance(raw, list | tuple) or len(raw) < 3:
        raise ParameterError("corners", f"expected a list of at least three [x, y], got {raw!r}")
    for corner in raw:
        if not isinstance(corner, list | tuple) or len(corner) != 2:
            raise ParameterError("corners", f"a corner is [x, y] in metres, got {corner!r}")
    return tuple((_METRES.read(x), _METRES.read(y)) for x, y in raw)


def read_zones(kind: type[ZoneKind], raw: Iterable[Any]) -> tuple[ZoneKind, ...]:
    """Read zones from file values: mappings, or lists of corners.

    Raises:
        ParameterError: a zone is wrong; the parameter named is `zones`.
    """
    zones = []
    for number, item in enumerate(raw, start=1):
        if isinstance(item, kind):
            zones.append(item)
            continue
        values = dict(item) if isinstance(item, Mapping) else {"corners": item}
        try:
            zones.append(build(kind, {"name": f"zone {number}", **values}))
        except ParameterError as error:
            raise ParameterError("zones", f"zone {number}: {error}", error.hint) from None
    return tuple(zones)


def located_mask(name: str, folder: Path, user: str) -> str:
    """Return the path of a mask file named in a mission.

    Args:
        name: as written, relative to the folder.
        folder: of the mission file.
        user: what has the mask, for the message.

    Raises:
        InputError: the file does not exist.
    """
    file = folder / name
    if not file.is_file():
        raise InputError(
            f"{user}: mask file {name} does not exist; paths are relative to the mission file"
        )
    return str(file)


def read_mask(file: str) -> OccupancyGrid | None:
    """Read the mask from a ROS map.yaml; None for an empty name.

    Raises:
        InputError: the file cannot be read; every finding has its position.
    """
    if not file:
        return None
    from stack.mapping.ros_map import read_ros_map

    return read_ros_map(Path(file))


class ZoneCells:
    """Zone number of each cell of a costmap, updated as the costmap moves.

    Args:
        zones: polygons.
        mask: its occupied cells are a zone too; None without one.
        margin: metres by which the zones are drawn larger, at least a cell's diagonal; or 0.

    Attributes:
        cells: (rows, columns) uint8: 0 for no zone, n for the n-th zone (the last one where zones
            overlap), IN_MASK where only the mask is occupied.
    """

    def __init__(
        self, zones: tuple[Zone, ...], mask: OccupancyGrid | None, margin: float = 0.0
    ) -> None:
        if len(zones) >= IN_MASK:
            raise ParameterError("zones", f"{len(zones)} zones, at most {IN_MASK - 1} fit")
        self._zones, self._mask, self._margin = zones, mask, margin
        self.frame = Frame((0, 0), 1.0, (0.0, 0.0))
        self.cells: NDArray[np.uint8] = np.empty((0, 0), dtype=np.uint8)

    def lay_out(self, frame: Frame, shift: tuple[int, int] | None) -> None:
        """Follow a move or resize of the costmap."""
        same = self.cells.shape == frame.shape
        self.frame = frame
        if shift is None or not same:
            self.cells = np.zeros(frame.shape, dtype=np.uint8)
            self._draw(frame.everywhere)
            return
        self.cells = shifted(self.cells, frame.shape, shift, 0)
        for strip in edges(frame.shape, shift, lead=0, trail=0):
            self._draw(strip)

    def name_at(self, row: int, column: int) -> str | None:
        """Return the name of the zone at a cell, None outside all zones."""
        number = int(self.cells[row, column])
        if number == 0:
            return None
        return "mask" if number == IN_MASK else self._zones[number - 1].name

    def by_name(self) -> dict[str, NDArray[np.bool_]]:
        """Return the cells of each zone, (rows, columns)."""
        found: dict[str, NDArray[np.bool_]] = {}
        for number in np.unique(self.cells[self.cells > 0]).tolist():
            name = "mask" if number == IN_MASK else self._zones[number - 1].name
            found[name] = (self.cells == number) | found.get(name, False)
        return found

    def covers(self, pose: Pose2D) -> bool:
        """Whether a pose is in a zone, or within the margin of one."""
        row, column = self.frame.cell_at(pose)
        rows, columns = self.cells.shape
        return bool(0 <= row < rows and 0 <= column < columns and self.cells[row, column])

    def _draw(self, box: Box) -> None:
        target = part(self.cells, box)
        target[:] = 0
        margin = max(self._margin, CELL_DIAGONAL * self.frame.resolution) if self._margin else 0.0
        if self._mask is not None:
            target[self._in_mask(self._mask, box, margin)] = IN_MASK
        for number, zone in enumerate(self._zones, start=1):
            if margin:
                near, found = cells_beside(self.frame, zone.points, box, margin)
                cells = part(self.cells, near)
                cells[found & (cells == 0)] = number
        for number, zone in enumerate(self._zones, start=1):
            region = cells_inside(self.frame, zone.points, box)
            part(self.cells, region[0])[region[1]] = number

    def _in_mask(self, mask: OccupancyGrid, box: Box, margin: float) -> NDArray[np.bool_]:
        """Return the cells of a box that are in the mask or within the margin of it."""
        import cv2

        by = ceil(margin / self.frame.resolution - 1e-9)
        top, bottom, left, right = box
        around = top - by, bottom + by, left - by, right + by
        occupied = mask.are_occupied(sampled(mask, self.frame, around, FREE))
        if not by or not occupied.any():
            return occupied[by : by + bottom - top, by : by + right - left]
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1))
        grown = cv2.dilate(occupied.astype(np.uint8), disc) > 0
        return np.asarray(grown[by : by + bottom - top, by : by + right - left])


def cells_inside(frame: Frame, corners: FloatArray, within: Box) -> tuple[Box, NDArray[np.bool_]]:
    """Return the part of a polygon's bounding box within another box, and the cells inside.

    A cell is inside the polygon when its centre is.

    Args:
        frame: cell grid, map frame.
        corners: (n, 2) of the polygon, metres, map frame.
        within: limit of the box, cells.
    """
    box, points = _centres(frame, corners, within, 0.0)
    return box, points_inside(points, corners).reshape(box[1] - box[0], box[3] - box[2])


def cells_beside(
    frame: Frame, corners: FloatArray, within: Box, margin: float
) -> tuple[Box, NDArray[np.bool_]]:
    """Return the cells within `margin` metres of a polygon's edges, as `cells_inside`."""
    box, points = _centres(frame, corners, within, margin)
    near = distances_to_edges(points, corners) <= margin + 1e-9
    return box, near.reshape(box[1] - box[0], box[3] - box[2])


def _centres(
    frame: Frame, corners: FloatArray, within: Box, margin: float
) -> tuple[Box, FloatArray]:
    """Return a polygon's bounding box, grown by metres, and the (n, 2) centres of its cells."""
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    box = common(frame.box_around((low[0], low[1]), (high[0], high[1])), within)
    if not is_some(box):
        return NO_BOX, np.empty((0, 2))
    x, y = np.broadcast_arrays(*frame.middles(box))
    return box, np.column_stack([x.ravel(), y.ravel()])
