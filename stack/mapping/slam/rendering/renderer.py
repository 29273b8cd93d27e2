"""Map renderer: log-odds of the cells from the scans of keyframes, drawn incrementally."""

from __future__ import annotations

from typing import Any

import numpy as np

from stack.localisation.planar import as_row
from stack.mapping.slam.graph import Keyframe, PoseGraph
from stack.mapping.slam.parameters import MapperParameters
from stack.mapping.slam.rendering import kernels
from stack.types import FREE, OCCUPIED, UNKNOWN, FloatArray, OccupancyGrid

CLEAR_RANGE = 4.0
"""Distance that a beam without return clears in the map, m."""

HIT, MISS = 850, 400
"""Log-odds in thousandths of a return and of a beam that passes (p = 0.7 and 0.4)."""

GROWTH = 8.0
"""Metres by which the grid grows at a side."""


class Drawing:
    """A growing grid of log-odds."""

    def __init__(self, parameters: MapperParameters) -> None:
        self._parameters = parameters
        self.odds: Any = np.zeros((0, 0), np.int16)
        self.origin = (0.0, 0.0)
        self.drawn: set[int] = set()

    def draw(self, keyframe: Keyframe) -> None:
        """Add the scan of a keyframe at its pose."""
        p, scan = self._parameters, keyframe.scan
        sensor = as_row(keyframe.pose.compose(scan.mount))
        returned = scan.ranges[np.isfinite(scan.ranges)]
        clear = min(CLEAR_RANGE, scan.range_max)
        reach = max(clear, min(p.match_range, float(returned.max(initial=0.0)))) + 0.5
        self._cover(sensor[0], sensor[1], reach)
        kernels.insert_scan(
            self.odds, *self.origin, p.resolution, sensor, np.ascontiguousarray(scan.angles),
            np.ascontiguousarray(scan.ranges), p.match_range, clear, HIT, MISS,
        )  # fmt: skip
        self.drawn.add(keyframe.id)

    def grid(self) -> OccupancyGrid:
        """Return the trinary occupancy grid."""
        cells = np.full(self.odds.shape, UNKNOWN, np.int8)
        cells[self.odds < 0] = FREE
        cells[self.odds > 0] = OCCUPIED
        return OccupancyGrid(cells, self._parameters.resolution, self.origin)

    def fit(self, points: FloatArray) -> tuple[int, float]:
        """Return the number of points at walls, and the share in space that was seen free.

        The share is that of the points in known space.
        """
        import cv2

        cells = np.floor((points - self.origin) / self._parameters.resolution).astype(np.int64)
        rows, columns = self.odds.shape
        inside = ((cells >= 0) & (cells < (columns, rows))).all(axis=1)
        column, row = cells[inside].T
        near = cv2.dilate((self.odds > 0).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
        at_walls = near[row, column]
        walls = int(np.count_nonzero(at_walls))
        free = int(np.count_nonzero((self.odds[row, column] < 0) & ~at_walls))
        return walls, free / max(1, walls + free)

    def _cover(self, x: float, y: float, reach: float) -> None:
        """Grow the grid so that it covers a square around (x, y)."""
        size = self._parameters.resolution
        rows, columns = self.odds.shape
        block = max(1, round(GROWTH / size))
        if not rows:
            start = [np.floor((v - reach) / size / block) * block * size for v in (x, y)]
            self.origin = (float(start[0]), float(start[1]))
        left, below = self.origin
        low = [max(0, int(np.ceil((a - (v - reach)) / size))) for a, v in ((below, y), (left, x))]
        high = [
            max(0, int(np.ceil(((v + reach) - (a + n * size)) / size)))
            for a, v, n in ((below, y, rows), (left, x, columns))
        ]
        if not any(low) and not any(high):
            return
        low, high = ([-(-n // block) * block for n in side] for side in (low, high))
        self.odds = np.pad(self.odds, ((low[0], high[0]), (low[1], high[1])))
        self.origin = (left - low[1] * size, below - low[0] * size)


class MapRenderer:
    """Draws keyframes as they come, and again in pieces after the graph was optimised."""

    def __init__(self, parameters: MapperParameters) -> None:
        self._parameters = parameters
        self._shown = Drawing(parameters)
        self._next: Drawing | None = None
        self._waiting: list[int] = []
        self._is_outdated = False
        self._grid: OccupancyGrid | None = None

    def add(self, keyframe: Keyframe) -> None:
        """Draw a new keyframe."""
        self._shown.draw(keyframe)
        self._grid = None
        if self._next is not None:
            self._next.draw(keyframe)

    def moved(self, graph: PoseGraph) -> None:
        """Begin to draw all keyframes again at their new poses."""
        self._next, self._waiting = Drawing(self._parameters), list(graph.keyframes)

    def outdate(self, graph: PoseGraph) -> None:
        """Draw all keyframes again, after the drawing that is under way."""
        if self._next is None:
            self.moved(graph)
        else:
            self._is_outdated = True

    def step(self, graph: PoseGraph, count: int) -> bool:
        """Draw up to `count` of the waiting keyframes; return whether the new map is shown now."""
        if self._next is None:
            return False
        for number in self._waiting[:count]:
            if number in graph.keyframes and number not in self._next.drawn:
                self._next.draw(graph.keyframes[number])
        del self._waiting[:count]
        if self._waiting:
            return False
        self._shown, self._next, self._grid = self._next, None, None
        if self._is_outdated:
            self._is_outdated = False
            self.moved(graph)
        return True

    def grid(self, graph: PoseGraph) -> OccupancyGrid:
        """Return the map with all keyframes at their newest poses."""
        while self._next is not None:
            self.step(graph, len(self._waiting))
        return self.shown

    @property
    def shown(self) -> OccupancyGrid:
        """The map as far as it is drawn; a new object after each change."""
        if self._grid is None:
            self._grid = self._shown.grid()
        return self._grid
