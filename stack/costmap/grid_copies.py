"""Copies of a costmap for other threads, reused and updated only where the cells changed.

A copy of all cells for each plan would cost time with the area of the map: 20 ms for 200 x 200 m at
2.5 cm.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from stack.costmap.layer import Box, joined, part
from stack.types import CostGrid

CHANGES_REMEMBERED = 256
"""Number of changes that are remembered; an older copy is not reused."""


@dataclass(frozen=True, slots=True)
class GridCopy:
    """The costs at one time; they do not change until the copy is released.

    Attributes:
        grid: the costs.
    """

    grid: CostGrid
    _version: int
    _released: list[GridCopy]

    def release(self) -> None:
        """Allow the reuse of the cells, once nobody reads them any more; from any thread."""
        self._released.append(self)


class GridCopies:
    """The changes of a costmap, and its released copies.

    Attributes:
        version: increases with each change.
        changes: the last ones, oldest first: version after the change, and the changed cells.
    """

    def __init__(self) -> None:
        self.changes: deque[tuple[int, Box]] = deque(maxlen=CHANGES_REMEMBERED)
        self.version = 0
        self._released: list[GridCopy] = []

    def note(self, changed: Box) -> None:
        """Remember that cells in a box may have changed."""
        self.version += 1
        self.changes.append((self.version, changed))

    def renew(self) -> None:
        """Forget all copies: the costmap has another frame, or all cells changed."""
        self.changes.clear()
        self.version += 1
        self._released = []

    def take(self, grid: CostGrid) -> GridCopy:
        """Return a copy of the costmap's current costs."""
        while self._released:
            old = self._released.pop()
            age = self.version - old._version
            if age <= len(self.changes):
                box = joined(self.changes[-1 - back][1] for back in range(age))
                part(old.grid.cells, box)[:] = part(grid.cells, box)
                cells = old.grid.cells
                break
        else:
            cells = grid.cells.copy()
        copy = CostGrid(cells, grid.resolution, grid.origin)
        return GridCopy(copy, self.version, self._released)
