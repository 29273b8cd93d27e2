"""Where the marks of a sensor layer are, so that expiry does not search the whole map.

One box around all marks would be as large as the square around a minute's drive.
"""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.costmap.layer import NO_BOX, Box, common, is_some, joined, moved

TILE_CELLS = 128
"""Side of a tile, cells."""


class MarkBoxes:
    """Boxes that contain all marks of a grid of times, at most one in each tile of the grid."""

    def __init__(self) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._boxes: dict[tuple[int, int], Box] = {}
        self._oldest: dict[tuple[int, int], float] = {}  # no mark of the tile is older, seconds

    def add(self, box: Box, time: float = -inf) -> None:
        """Remember that a box may contain new marks.

        Args:
            box: cells.
            time: of the marks, seconds; -inf: of any time.
        """
        time = float(np.float32(time))  # as the marks store it
        if not is_some(box):
            return
        top, bottom, left, right = box
        for row in range(top - top % TILE_CELLS, bottom, TILE_CELLS):
            for column in range(left - left % TILE_CELLS, right, TILE_CELLS):
                tile = row, column
                inside = common(box, (row, row + TILE_CELLS, column, column + TILE_CELLS))
                self._boxes[tile] = joined([self._boxes.get(tile, NO_BOX), inside])
                self._oldest[tile] = min(self._oldest.get(tile, inf), time)

    def clear(self) -> None:
        """Forget all boxes: there are no marks."""
        self._boxes, self._oldest = {}, {}

    def move(self, shape: tuple[int, int], shift: tuple[int, int]) -> None:
        """Follow a move of the grid; marks that leave it are gone."""
        whole, oldest = joined(self._boxes.values()), min(self._oldest.values(), default=inf)
        self.clear()
        self.add(moved(whole, shape, shift), oldest)

    def older(self, time: float, region: Box) -> list[Box]:
        """Boxes of a region that may contain marks before `time`, seconds."""
        parts = [
            common(box, region) for tile, box in self._boxes.items() if self._oldest[tile] < time
        ]
        return [part for part in parts if is_some(part)]

    def expire(self, marked_at: NDArray[Any], oldest: float) -> Box:
        """Clear marks before `oldest`; return the box of the cleared cells.

        Args:
            marked_at: (rows, columns) float32 time of each mark, -inf without.
            oldest: seconds.
        """
        cleared = []
        for tile, box in list(self._boxes.items()):
            if self._oldest[tile] >= oldest:
                continue
            gone, kept, self._oldest[tile] = self._kernels.expire(marked_at, oldest, *box)
            cleared.append(gone)
            if is_some(kept):
                self._boxes[tile] = kept
            else:
                del self._boxes[tile], self._oldest[tile]
        return joined(cleared)
