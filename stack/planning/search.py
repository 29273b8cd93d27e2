"""Step costs and reusable arrays of the A* search."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.components import CancelToken
from stack.types import INSCRIBED_COST, LETHAL_COST, UNKNOWN_COST, CostGrid, Pose2D

_FREE_STEP = 100  # cost of a straight step over a free cell: integers are exact to 0.5 %


@dataclass(frozen=True)
class StepCosts:
    """Integer cost of a step into a cell, by cell cost; 0 if the cell is impassable.

    Attributes:
        traverse: (256,) int64, straight step.
        diagonal: (256,) int64, diagonal step.
        escape: (256,) int64, step into an impassable cell while leaving an occupied start.
    """

    traverse: NDArray[np.int64]
    diagonal: NDArray[np.int64]
    escape: NDArray[np.int64]

    @staticmethod
    def of(cost_weight: float, allow_unknown: bool, unknown_as: float = 126.0) -> StepCosts:
        """Return tables with step cost 100 · (1 + cost_weight · c / 252) for cell cost c.

        Unknown cells count as cells of cost `unknown_as`.
        """
        share = np.arange(256, dtype=np.float64) / (INSCRIBED_COST - 1)
        share[UNKNOWN_COST] = unknown_as / (INSCRIBED_COST - 1)
        traverse = np.rint(_FREE_STEP * (1.0 + cost_weight * share)).astype(np.int64)
        traverse[INSCRIBED_COST : LETHAL_COST + 1] = 0
        if not allow_unknown:
            traverse[UNKNOWN_COST] = 0
        diagonal = np.rint(traverse * 2.0**0.5).astype(np.int64)
        dearest = int(diagonal.max())
        escape = np.zeros(256, dtype=np.int64)
        escape[[INSCRIBED_COST, UNKNOWN_COST]] = 2 * dearest
        escape[LETHAL_COST] = 4 * dearest
        return StepCosts(traverse, diagonal, escape)


@dataclass(frozen=True)
class ExpansionLimits:
    """Limits of a search.

    Attributes:
        max_expansions: maximum number of expansions.
        cancel: set by the caller to stop the search.
    """

    max_expansions: int = 2**62
    cancel: CancelToken = field(default_factory=CancelToken)


_LONGEST = 64
"""A path is expected to cost at most this many times as much as one of free cells."""

_NEAR = 512
"""Cells added to the distance from start to goal in that rule: the way round a wall beside them."""

UNLIMITED = ExpansionLimits()
"""No limit on expansions, and no caller that could cancel."""


class Workspace:
    """Arrays of an A* search, reused between queries on grids of one shape without clearing.

    Each query takes `limit` + 1 numbers of the range of `reached`; when the range is used up, all
    cells are cleared. A query that needs more than its limit is repeated with a higher one.

    Attributes:
        reached, base, limit: cell n was reached at the cost reached[n] - base if that is at most
            limit.
        highest: largest limit of a query, as long as the range of `reached` is 32 bits.
        parents: (cells,) uint8, direction of the step into each reached cell.
        expanded: number of cells that the last search expanded.
        limited: whether the last search stopped at its limit of expansions.
    """

    def __init__(self, rows: int, columns: int, tables: StepCosts) -> None:
        from stack.planning import kernels

        self._kernels: Any = kernels
        self._shape, self._tables = (rows, columns), tables
        self.expanded, self.limited = 0, False
        cells = rows * columns
        rise = int(max(tables.escape.max(), tables.diagonal.max()) + tables.diagonal[0])
        self._heads = np.full(1 << rise.bit_length(), -1, dtype=np.int32)
        self._set_queue(cells // 4 + 1024)
        self.parents = np.empty(cells, dtype=np.uint8)
        self.highest = min(_LONGEST * (rows + columns) * int(tables.diagonal.max()), 2**31 - 1)
        self.limit = self.highest
        self.reached: NDArray[Any] = np.empty(cells, dtype=np.int32)
        self._forget()

    def fitting(self, costs: CostGrid) -> Workspace:
        """Return this workspace, or a new one if the grid has another shape."""
        rows, columns = costs.cells.shape
        return self if self._shape == (rows, columns) else Workspace(rows, columns, self._tables)

    def run(
        self,
        costs: CostGrid,
        start: int,
        goal: int,
        escape_reach: int,
        limits: ExpansionLimits = UNLIMITED,
    ) -> bool:
        """Search from a start cell to a goal cell; return whether the goal was reached.

        Args:
            costs: grid of this workspace's shape.
            start: cell index, row * columns + column.
            goal: cell index.
            escape_reach: cells from the start within which impassable cells may be entered.
            limits: limit of expansions and cancel token.

        Raises:
            NavigationError: CANCELLED when the cancel token is set.
        """
        kernels, tables = self._kernels, self._tables
        self.limit = self._expected(start, goal)
        while True:
            self._next_base()
            status, _, self.expanded = kernels.search(
                costs.cells, tables.traverse, tables.diagonal, tables.escape, escape_reach,
                self.reached, self.parents, self.base, self.limit,
                self._heads, self._queue, self._links, start, goal,
                limits.max_expansions, limits.cancel.flag,
            )  # fmt: skip
            self.limited = status == kernels.LIMIT
            limits.cancel.check()
            if status == kernels.QUEUE_FULL:
                self._set_queue(2 * self._links.size)
            elif status == kernels.RANGE_FULL and self.limit < self.highest:
                self.limit = self.highest
            elif status == kernels.RANGE_FULL:  # a very long path: 64 bits hold any path cost
                self.highest = self.limit = 2**60
                self.reached = np.empty(self.reached.size, dtype=np.int64)
                self._forget()
            else:
                return bool(status == kernels.FOUND)

    def nearest_reached(self, costs: CostGrid, place: Pose2D) -> tuple[int, int] | None:
        """Return (row, column) of the passable reached cell nearest to a place, or None."""
        passable = (self._tables.traverse > 0)[costs.cells].ravel()
        return nearest_marked(costs, passable & (self.reached <= self.base + self.limit), place)

    def _expected(self, start: int, goal: int) -> int:
        """Return the limit for a path between two cells, unless it is unusually long."""
        (row, column), (to_row, to_column) = (divmod(n, self._shape[1]) for n in (start, goal))
        steps = abs(row - to_row) + abs(column - to_column) + _NEAR
        return min(_LONGEST * steps * int(self._tables.traverse[0]), self.highest)

    def _next_base(self) -> None:
        if self.base - self.limit - 1 < np.iinfo(self.reached.dtype).min:
            self._forget()
        self.base -= self.limit + 1

    def _forget(self) -> None:
        self.base = int(np.iinfo(self.reached.dtype).max)
        self.reached.fill(self.base)

    def _set_queue(self, size: int) -> None:
        self._queue = np.empty((size, 2), dtype=np.int64)
        self._links = np.empty(size, dtype=np.int32)


def nearest_marked(
    costs: CostGrid, marked: NDArray[np.bool_], place: Pose2D
) -> tuple[int, int] | None:
    """Return (row, column) of the cell nearest to a place among those marked (cells,), or None."""
    from stack.planning import kernels

    search: Any = kernels.nearest_marked
    (x, y), columns = costs.origin, int(costs.cells.shape[1])
    row, column = (place.y - y) / costs.resolution, (place.x - x) / costs.resolution
    cell = int(search(marked, columns, row, column))
    return None if cell < 0 else divmod(cell, columns)
