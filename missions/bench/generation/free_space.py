"""Free space of a floor plan: where the robot fits, and what it can reach."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from missions.bench.generation.floor_plan import WALL, FloorPlan, Piece, Room
from stack.types import FloatArray

CELL = 0.05
"""Side of a cell, metres."""

MARGIN = 0.08
"""Metres added to the robot's radius: one cell of a 5 cm map, and half a cell of this grid."""


class FreeSpace:
    """Cells of a floor plan, the distance of each to the nearest obstacle, and what is connected.

    Args:
        plan: with walls and openings.
        radius: inscribed radius of the robot, metres.
    """

    def __init__(self, plan: FloorPlan, radius: float) -> None:
        self._radius = radius + MARGIN
        x_min, y_min, x_max, y_max = plan.bounds
        self._origin = np.array([x_min, y_min])
        shape = round((y_max - y_min) / CELL), round((x_max - x_min) / CELL)
        self._free = np.full(shape, 255, np.uint8)
        for begin, end in plan.walls:
            (x0, y0), (x1, y1) = begin, end
            low = np.array([min(x0, x1), min(y0, y1)]) - WALL / 2.0
            high = np.array([max(x0, x1), max(y0, y1)]) + WALL / 2.0
            corners = [low, (high[0], low[1]), high, (low[0], high[1])]
            self._fill(self._free, np.array(corners))
        for piece in plan.pieces:
            self._fill(self._free, piece.corners)
        self.clearance = self._clearance(self._free)

    def with_piece(self, piece: Piece) -> NDArray[np.uint8]:
        """Return the free cells if a piece of furniture is added."""
        free = self._free.copy()
        self._fill(free, piece.corners)
        return free

    def keep(self, free: NDArray[np.uint8]) -> None:
        """Continue with cells of `with_piece`."""
        self._free, self.clearance = free, self._clearance(free)

    def is_connected(self, rooms: Sequence[Room], free: NDArray[np.uint8], share: float) -> bool:
        """Whether one connected region has at least a share of the area of each room.

        Args:
            rooms: the rooms.
            free: from `with_piece`.
            share: of each room's cells, in which the centre of the robot can be.
        """
        reached = self._largest(self._clearance(free))
        return all(
            np.count_nonzero(reached[self._cells_of(room)]) * CELL**2 >= share * room.area
            for room in rooms
        )

    def reachable(self) -> NDArray[np.bool_]:
        """Return the largest connected region of cells in which the centre of the robot can be."""
        return self._largest(self.clearance)

    def points_in(self, room: Room, clearance: float) -> FloatArray:
        """Return the reachable points (n, 2) of a room with some distance to obstacles, metres."""
        rows, columns = self._cells_of(room)
        fits = self.reachable()[rows, columns] & (self.clearance[rows, columns] >= clearance)
        found = np.argwhere(fits)[:, ::-1] + (columns.start, rows.start)
        points: FloatArray = self._origin + (found + 0.5) * CELL
        return points

    def is_clear(self, begin: FloatArray, end: FloatArray, clearance: float) -> bool:
        """Whether the straight line between two points keeps a distance to obstacles, metres."""
        steps = max(2, int(np.hypot(*(end - begin)) / CELL) + 1)
        points = begin + np.linspace(0.0, 1.0, steps)[:, None] * (end - begin)
        columns, rows = ((points - self._origin) / CELL).astype(int).T
        return bool((self.clearance[rows, columns] >= clearance).all())

    def _fill(self, free: NDArray[np.uint8], corners: FloatArray) -> None:
        import cv2

        pixels = np.rint((corners - self._origin) / CELL - 0.5).astype(np.int32)
        cv2.fillConvexPoly(free, pixels, 0)

    def _clearance(self, free: NDArray[np.uint8]) -> NDArray[np.float32]:
        import cv2

        distance: Any = cv2.distanceTransform(free, cv2.DIST_L2, 5)
        cells: NDArray[np.float32] = distance * CELL - CELL / 2.0
        return cells

    def _largest(self, clearance: NDArray[np.float32]) -> NDArray[np.bool_]:
        """Largest connected region inside the outer walls."""
        import cv2

        fits = (clearance >= self._radius).astype(np.uint8)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(fits, connectivity=4)
        edges = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
        outside = set(np.unique(edges).tolist())
        inside = [n for n in range(1, count) if n not in outside]
        if not inside:
            return np.zeros(labels.shape, bool)
        best = max(inside, key=lambda n: int(stats[n, cv2.CC_STAT_AREA]))
        region: NDArray[np.bool_] = labels == best
        return region

    def _cells_of(self, room: Room) -> tuple[slice, slice]:
        low = ((np.array(room.bounds[:2]) - self._origin) / CELL).astype(int)
        high = np.ceil((np.array(room.bounds[2:]) - self._origin) / CELL).astype(int)
        return slice(low[1], high[1]), slice(low[0], high[0])
