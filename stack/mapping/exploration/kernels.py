"""Compiled loops of the exploration: what a view of a place would show."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
from numba import f8, i1, i8
from numpy.typing import NDArray

from stack.geometry.travel.kernels import TRAVEL
from stack.kernel_cache import njit
from stack.types import FloatArray


@njit(cache=True, nogil=True)
def unknown_in_view(
    kinds: NDArray[np.int8], rows_at: NDArray[np.int64], columns_at: NDArray[np.int64],
    reach: float, depth: float, rays: int,
) -> FloatArray:  # fmt: skip
    """Unknown area that a view from a cell could show, in cells.

    Rays end at occupied cells, at the reach, and after `depth` cells of unknown space: what is
    behind is a guess. A ray covers r · dr · dθ of the area.

    Args:
        kinds: (rows, columns): -1 unknown, 0 free, 1 occupied; outside is not counted.
        rows_at: (n,) of the cells.
        columns_at: (n,) likewise.
        reach: of the sensor, cells.
        depth: of unknown space that counts, cells.
        rays: number of rays of a turn.

    Returns:
        (n,) cells.
    """
    rows, columns = kinds.shape
    found = np.zeros(rows_at.size)
    for n in range(rows_at.size):
        for ray in range(rays):
            angle = 2.0 * pi * ray / rays
            c, s = cos(angle), sin(angle)
            r, unseen = 0.5, 0.0
            last_y, last_x = rows_at[n], columns_at[n]
            while r < reach and unseen < depth:
                y = int(rows_at[n] + 0.5 + r * s)
                x = int(columns_at[n] + 0.5 + r * c)
                if y < 0 or x < 0 or y >= rows or x >= columns or kinds[y, x] == 1:
                    break
                if y != last_y and x != last_x and (kinds[y, last_x] == 1 or kinds[last_y, x] == 1):
                    break  # past the corner of a wall whose cells touch diagonally
                last_y, last_x = y, x
                if kinds[y, x] == -1:
                    found[n] += r
                    unseen += 1.0
                r += 1.0
        found[n] *= 2.0 * pi / rays
    return found


@njit(cache=True, nogil=True)
def in_sight(
    kinds: NDArray[np.int8], cells: NDArray[np.int64], row: float, column: float
) -> NDArray[np.bool_]:
    """Whether no occupied cell is on the line from each of some cells to a cell.

    The lines are sampled about twice per cell, at the numbers of np.linspace.

    Args:
        kinds: (rows, columns): -1 unknown, 0 free, 1 occupied.
        cells: (n, 2) row and column.
        row: of the other end.
        column: of the other end.

    Returns:
        (n,) bool.
    """
    clear = np.ones(cells.shape[0], np.bool_)
    for n in range(cells.shape[0]):
        first_row, first_column = float(cells[n, 0]), float(cells[n, 1])
        rise, run = row - first_row, column - first_column
        parts = int(2.0 * max(abs(rise), abs(run))) + 1
        row_step, column_step = rise / parts, run / parts
        for part in range(parts + 1):
            y, x = part * row_step + first_row, part * column_step + first_column
            if row_step == 0.0 or column_step == 0.0:
                y, x = part / parts * rise + first_row, part / parts * run + first_column
            if part == parts:
                y, x = row, column
            if kinds[int(np.rint(y)), int(np.rint(x))] == 1:
                clear[n] = False
                break
    return clear


EXPLORATION = (
    *TRAVEL,
    (unknown_in_view, (i1[:, ::1], i8[::1], i8[::1], f8, f8, i8)),
    (in_sight, (i1[:, ::1], i8[:, ::1], f8, f8)),
)
"""Entry points with the types that the stack calls them with."""
