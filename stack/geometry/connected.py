"""Connected cells of a grid, without a library: `treepilot check` imports no heavy one."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

Cell = tuple[int, int]


def connected_to(free: NDArray[np.bool_], cells: Iterable[Cell]) -> NDArray[np.bool_]:
    """Return the free cells that are connected to one of some cells, over edges or corners.

    The free cells of each row form runs. Runs that touch in neighbouring rows are found for the
    whole grid at once; only the search from run to run is a loop.

    Args:
        free: (rows, columns).
        cells: (row, column) of each beginning, inside the grid; occupied ones lead nowhere.

    Returns:
        (rows, columns), a subset of `free`.
    """
    width = free.shape[1] + 2  # of a row in the flat numbers: runs in neighbouring rows never touch
    edges = np.diff(np.pad(free, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, columns = np.nonzero(edges == 1)
    firsts = rows * width + columns
    rows, columns = np.nonzero(edges == -1)
    ends = rows * width + columns
    touching = []
    for row in (-width, width):
        low = np.searchsorted(ends, firsts + row, "left")
        high = np.searchsorted(firsts, ends + row, "right")
        touching.append((low.tolist(), high.tolist()))
    starts = (row * width + column for row, column in cells if free[row, column])
    waiting = [int(np.searchsorted(firsts, cell, "right")) - 1 for cell in starts]
    reached = np.zeros(len(firsts), dtype=np.bool_)
    reached[waiting] = True
    while waiting:
        run = waiting.pop()
        for low, high in touching:
            for other in range(low[run], high[run]):
                if not reached[other]:
                    reached[other] = True
                    waiting.append(other)
    steps = np.zeros(free.shape[0] * width, dtype=np.int8)
    steps[firsts[reached]] = 1
    steps[ends[reached]] = -1
    inside: NDArray[np.bool_] = np.cumsum(steps, dtype=np.int8).reshape(-1, width) > 0
    return inside[:, : free.shape[1]]
