"""Where the marks of a sensor layer are, so that expiry does not search the whole map.

One box around all marks would be as large as the square around a minute's drive.
"""

from __future__ import annotations

from typing import Any

from numpy.typing import NDArray

from stack.costmap.layer import Box, is_some, joined, moved

TILE = 128
"""Side of a tile, cells."""


class MarkBoxes:
    """Boxes that contain all marks of a grid of times, at most one in each tile of the grid."""

    def __init__(self) -> None:
        from stack.costmap import kernels

        self._kernels: Any = kernels
        self._boxes: dict[tuple[int, int], Box] = {}

    def add(self, box: Box) -> None:
        """Remember that a box may contain new marks."""
        if not is_some(box):
            return
        top, bottom, left, right = box
        for row in range(top - top % TILE, bottom, TILE):
            for column in range(left - left % TILE, right, TILE):
                inside = (
                    max(top, row), min(bottom, row + TILE),
                    max(left, column), min(right, column + TILE),
                )  # fmt: skip
                known = self._boxes.get((row, column))
                self._boxes[row, column] = inside if known is None else joined([known, inside])

    def clear(self) -> None:
        """Forget all boxes: there are no marks."""
        self._boxes = {}

    def move(self, shape: tuple[int, int], shift: tuple[int, int]) -> None:
        """Follow a move of the grid; marks that leave it are gone."""
        boxes, self._boxes = self._boxes, {}
        self.add(moved(joined(boxes.values()), shape, shift))

    def expire(self, marked_at: NDArray[Any], oldest: float) -> Box:
        """Clear marks before `oldest`; return the box of the cleared cells.

        Args:
            marked_at: (rows, columns) float32 time of each mark, -inf without.
            oldest: seconds.
        """
        cleared = []
        for tile, box in list(self._boxes.items()):
            gone, kept = self._kernels.expire(marked_at, oldest, *box)
            cleared.append(gone)
            if is_some(kept):
                self._boxes[tile] = kept
            else:
                del self._boxes[tile]
        return joined(cleared)
