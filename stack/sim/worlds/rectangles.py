"""Rectangles that cover the marked cells of a grid."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def merged_cells(occupied: NDArray[np.bool_]) -> list[tuple[int, int, int, int]]:
    """Cover the occupied cells with disjoint rectangles.

    Greedy: a run of cells in a row grows over the next rows as long as they contain the same run.

    Args:
        occupied: (rows, columns).

    Returns:
        First row, last row + 1, first column, last column + 1 of each rectangle.
    """
    found: list[tuple[int, int, int, int]] = []
    filled: NDArray[np.bool_] = np.asarray(occupied.any(axis=1))
    growing: dict[tuple[int, int], int] = {}
    for row in range(occupied.shape[0] + 1):
        runs = _runs(occupied[row]) if row < occupied.shape[0] and filled[row] else []
        continued = set(runs)
        ended = [run for run in growing if run not in continued]
        found += [(growing.pop(run), row, *run) for run in ended]
        for run in runs:
            growing.setdefault(run, row)
    return found


def _runs(row: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first column and last column + 1 of each run of occupied cells in a row."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], row.astype(np.int8), [0]])))
    return [(int(first), int(last)) for first, last in edges.reshape(-1, 2)]
