"""The shortest way out of keep-out zones, for a robot that stands in one."""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import Frame, sampled
from stack.costmap.zones import ZONE_MARGIN, Zone, ZoneCells
from stack.geometry.distance_transform import distances_to_zero
from stack.types import FREE, OCCUPIED, UNKNOWN, Footprint, OccupancyGrid, Pose2D

CELL_SIDE = 0.05
"""Side of a cell, metres."""
MAX_CELLS = 1 << 20
"""Larger areas have larger cells."""
SEARCHED_AROUND = 1.0
"""Metres around the zones, beside the robot's own size, in which it may stop outside."""
WAY_RESTARTS_AT = 0.2
"""Metres from its way at which a robot that leaves a zone takes the way from where it is."""
SPARE_CELLS = 2
"""Cells by which the lane is wider than the robot: costmaps have other cells."""

Cells = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Lane:
    """The way out from one pose.

    Attributes:
        cells: OCCUPIED where the robot may stand and turn on its way.
        line: (n, 2) points from the pose to the first place outside, map frame, metres.
        end: that place, map frame, with the heading along the way.
    """

    cells: OccupancyGrid
    line: NDArray[np.float64]
    end: Pose2D

    def left_by(self, pose: Pose2D) -> bool:
        """Whether a pose is beside the way, so that another one may be shorter."""
        return float(np.hypot(*(self.line - (pose.x, pose.y)).T).min()) > WAY_RESTARTS_AT


class WayOut:
    """Steps from each cell in a zone to the nearest place outside, round the map's walls.

    A place outside is free on the map and farther from zones and walls than the inscribed radius.

    Args:
        zones: polygons.
        mask: a further zone, or None.
        footprint: of the robot.
        static: the map, or None.
        pose: of the robot, in a zone, map frame.
    """

    def __init__(
        self, zones: tuple[Zone, ...], mask: OccupancyGrid | None, footprint: Footprint,
        static: OccupancyGrid | None, pose: Pose2D,
    ) -> None:  # fmt: skip
        self._footprint = footprint
        self.frame = _frame_around(zones, mask, footprint.circumscribed_radius, pose)
        drawn = ZoneCells(zones, mask, ZONE_MARGIN)
        drawn.lay_out(self.frame, None)
        known = np.full(self.frame.shape, FREE, np.int8)
        occupied = np.zeros(self.frame.shape, np.bool_)
        free = np.ones(self.frame.shape, np.bool_)
        if static is not None:
            known = sampled(static, self.frame, self.frame.everywhere, UNKNOWN)
            occupied, free = static.are_occupied(known), static.are_free(known)
        need = footprint.inscribed_radius / self.frame.resolution
        passable = distances_to_zero(~occupied) > need
        outside = passable & free & (distances_to_zero(drawn.cells == 0) > need + 1.0)
        self._steps = _steps_from(outside, passable)

    def lane(self, pose: Pose2D) -> Lane | None:
        """Return the way out from a pose; None if there is none."""
        start = self._start(pose)
        if start is None:
            return None
        way = [start]
        while self._steps[way[-1]]:
            way.append(self._next(*way[-1]))
        cells = np.zeros(self.frame.shape, np.uint8)
        rows, columns = np.array(way).T
        cells[rows, columns] = 1
        x, y = self.frame.origin
        line = (np.column_stack([columns, rows]) + 0.5) * self.frame.resolution + (x, y)
        end = Pose2D(float(line[-1, 0]), float(line[-1, 1]), pose.heading)
        near = line[max(0, len(line) - 5)]
        before = Pose2D(float(near[0]), float(near[1]))
        if end.distance_to(before) > 0.0:
            end = Pose2D(end.x, end.y, before.bearing_to(end))
        return Lane(self._widened(cells), line, end)

    def is_outside(self, pose: Pose2D) -> bool:
        """Whether a pose is outside the zones, with all of the robot."""
        row, column = self.frame.cell_at(pose)
        rows, columns = self.frame.shape
        return not (0 <= row < rows and 0 <= column < columns) or self._steps[row, column] == 0

    def _start(self, pose: Pose2D) -> tuple[int, int] | None:
        """Return the cell with a way out nearest to a pose, within the robot's outline."""
        resolution, (x, y) = self.frame.resolution, self.frame.origin
        rows, columns = np.nonzero(self._steps >= 0)
        if not rows.size:
            return None
        away = np.hypot(
            (rows + 0.5) * resolution + y - pose.y, (columns + 0.5) * resolution + x - pose.x
        )
        nearest = int(np.argmin(away))
        if away[nearest] > self._footprint.inscribed_radius + resolution:
            return None
        return int(rows[nearest]), int(columns[nearest])

    def _next(self, row: int, column: int) -> tuple[int, int]:
        """Return the neighbour that is one step nearer to the outside."""
        rows, columns = self.frame.shape
        for down, right in _NEIGHBOURS:
            r, c = row + down, column + right
            if 0 <= r < rows and 0 <= c < columns:
                if self._steps[r, c] == self._steps[row, column] - 1:
                    return r, c
        raise AssertionError("every step has one before it")

    def _widened(self, cells: NDArray[np.uint8]) -> OccupancyGrid:
        """Return the cells that the outline covers on the way, at any heading."""
        import cv2

        by = ceil(self._footprint.circumscribed_radius / self.frame.resolution) + SPARE_CELLS
        disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * by + 1, 2 * by + 1))
        wide = np.where(cv2.dilate(cells, disc) > 0, OCCUPIED, FREE).astype(np.int8)
        return OccupancyGrid(wide, self.frame.resolution, self.frame.origin)


_NEIGHBOURS = ((0, 1), (1, 0), (0, -1), (-1, 0), (1, 1), (1, -1), (-1, 1), (-1, -1))


def _frame_around(
    zones: tuple[Zone, ...], mask: OccupancyGrid | None, radius: float, pose: Pose2D
) -> Frame:
    """Return cells over the zones that touch, or nearly, where the robot stands."""
    boxes = [(*zone.points.min(axis=0), *zone.points.max(axis=0)) for zone in zones]
    if mask is not None:
        (x, y), (rows, columns) = mask.origin, mask.cells.shape
        boxes.append((x, y, x + columns * mask.resolution, y + rows * mask.resolution))
    grown = SEARCHED_AROUND + 2.0 * radius
    low_x, low_y, high_x, high_y = pose.x - grown, pose.y - grown, pose.x + grown, pose.y + grown
    while boxes:
        near = [
            box for box in boxes
            if box[0] < high_x and box[2] > low_x and box[1] < high_y and box[3] > low_y
        ]  # fmt: skip
        if not near:
            break
        boxes = [box for box in boxes if box not in near]
        low_x = min(low_x, *(box[0] - grown for box in near))
        low_y = min(low_y, *(box[1] - grown for box in near))
        high_x = max(high_x, *(box[2] + grown for box in near))
        high_y = max(high_y, *(box[3] + grown for box in near))
    resolution = max(CELL_SIDE, sqrt((high_x - low_x) * (high_y - low_y) / MAX_CELLS))
    shape = ceil((high_y - low_y) / resolution), ceil((high_x - low_x) / resolution)
    return Frame(shape, resolution, (float(low_x), float(low_y)))


def _steps_from(outside: Cells, passable: Cells) -> NDArray[np.int32]:
    """Return the (rows, columns) steps to the nearest cell outside; -1 where no way leads there.

    Steps over edges and over corners take turns, so that circles are octagons.
    """
    import cv2

    steps = np.where(outside, 0, -1).astype(np.int32)
    reached, number = outside.astype(np.uint8), 0
    edges = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    corners = cv2.getStructuringElement(cv2.MORPH_RECT, (3, 3))
    while True:
        number += 1
        for element in (edges, corners)[number % 2 :]:
            new = (cv2.dilate(reached, element) > 0) & passable & (reached == 0)
            if new.any():
                break
        if not new.any():
            return steps
        steps[new] = number
        reached[new] = 1
