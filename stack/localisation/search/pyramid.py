"""Multi-resolution maxima of a grid, the bounds of the branch-and-bound search."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

LEVELS = 7
"""Levels of a whole map's pyramid: boxes of 1 to 64 cells."""

_FINE = 2
"""Levels up to this one have an entry for each cell; those above one per quarter of a box."""


@dataclass(frozen=True, slots=True)
class Pyramid:
    """Upper bounds of a grid in boxes of 1, 2, 4, ... cells.

    An entry of level h bounds the grid in every box of side 2**h that begins within its stride.
    The stride is 2**(h - 2) cells, so the levels above the third need little memory.

    Attributes:
        cells: all levels, flat uint8.
        layout: (levels, 5) int64; its columns are named in `kernels`.
    """

    cells: NDArray[np.uint8]
    layout: NDArray[np.int64]


def build_pyramid(grid: NDArray[np.uint8], levels: int = LEVELS) -> Pyramid:
    """Return the pyramid of a grid (rows, columns); cells outside it are 0."""
    margin = 1 << levels
    largest = np.zeros((grid.shape[0] + margin, grid.shape[1] + margin), dtype=np.uint8)
    largest[margin:, margin:] = grid
    parts, layout, start = [], [], 0
    for level in range(levels):
        if level:
            largest = _doubled(largest, 1 << (level - 1))
        shift = max(0, level - _FINE)
        stride = 1 << shift
        pad = (1 << level) // stride + 1 if level else 0
        first = margin - pad * stride
        begin = largest[first::stride, first::stride]
        part = begin.copy()
        if stride > 1:
            # A box may begin anywhere in the stride; boxes overlap, so both ends cover it.
            end = largest[first + stride - 1 :: stride, :]
            low = begin if end.shape[0] == 0 else begin.copy()
            np.maximum(low[: end.shape[0]], end[:, first::stride], out=low[: end.shape[0]])
            across = largest[first::stride, first + stride - 1 :: stride]
            both = end[:, first + stride - 1 :: stride]
            part = low
            np.maximum(part[:, : across.shape[1]], across, out=part[:, : across.shape[1]])
            corner = part[: both.shape[0], : both.shape[1]]
            np.maximum(corner, both, out=corner)
        layout.append((start, *part.shape, shift, pad))
        parts.append(part.ravel())
        start += part.size
    return Pyramid(np.concatenate(parts), np.array(layout, dtype=np.int64))


def _doubled(largest: NDArray[np.uint8], side: int) -> NDArray[np.uint8]:
    """Return the maxima of boxes of twice the side, from those of boxes of `side` cells."""
    wider = largest.copy()
    np.maximum(wider[:-side], largest[side:], out=wider[:-side])
    both = wider.copy()
    np.maximum(both[:, :-side], wider[:, side:], out=both[:, :-side])
    return both
