"""Grids that follow the robot."""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

T = TypeVar("T", bound=np.generic)


def shifted(cells: NDArray[T], rows: int, columns: int, fill: Any) -> NDArray[T]:
    """Return a square grid moved by some cells; what leaves it is forgotten.

    Args:
        cells: (size, size).
        rows: cells by which the grid's first row moves up; the contents move down.
        columns: cells by which its first column moves right; the contents move left.
        fill: value of the cells that are new.
    """
    moved, size = np.full_like(cells, fill), len(cells)
    if max(abs(rows), abs(columns)) < size:
        moved[_kept(-rows, size), _kept(-columns, size)] = cells[
            _kept(rows, size), _kept(columns, size)
        ]
    return moved


def _kept(shift: int, size: int) -> slice:
    """Return the part of an axis that is still in a grid moved by `shift` cells."""
    return slice(max(0, shift), min(size, size + shift))
