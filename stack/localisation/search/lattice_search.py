"""Search of a grid of scores for the poses at which points have the largest sum.

Correlative scan matching (E. B. Olson, "Real-Time Correlative Scan Matching", ICRA 2009) by branch
and bound (W. Hess et al., "Real-Time Loop Closure in 2D LIDAR SLAM", ICRA 2016). It depends on no
estimator: a grid, points and a window go in, distinct poses with scores come out. A SLAM can search
a submap for loop closures with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray, Pose2D

HIGHEST = 255
"""Value of a cell in which a point matches best, as in `kernels`."""

LEVELS = 7
"""Levels of a whole map's pyramid: boxes of 1 to 64 cells."""

_FINE = 2
"""Levels up to this one have an entry for each cell; those above one per quarter of a box."""


@dataclass(frozen=True, slots=True)
class SearchWindow:
    """Poses around one: positions in a square, headings in an interval.

    Attributes:
        centre: of the window, map frame.
        distance: half the side of the square, metres.
        angle: half the interval of the headings, radians; pi: all headings.
    """

    centre: Pose2D
    distance: float
    angle: float


@dataclass(frozen=True, slots=True)
class LatticeMatches:
    """Distinct poses of a lattice, best first.

    Attributes:
        poses: (n, 3) x, y, heading, map frame.
        scores: (n,) in [0, 1]: mean value of the points' cells.
        complete: False if the search ended at its limit of boxes.
    """

    poses: FloatArray
    scores: FloatArray
    complete: bool


@dataclass(frozen=True, slots=True)
class SearchLimits:
    """Which poses of a search are returned.

    Attributes:
        fraction: smallest score, as a share of the best one.
        least: smallest score, in [0, 1].
        distance: metres; a pose nearer than this to a better one is not distinct from it,
        angle: radians; unless their headings differ by at least this.
        most: number of poses.
        boxes: number of boxes at which the search ends.
    """

    fraction: float = 0.7
    least: float = 0.1
    distance: float = 0.4
    angle: float = pi / 9
    most: int = 80
    boxes: int = 20_000_000


class LatticeSearch:
    """Search of one grid; its pyramid is built once.

    Args:
        values: (rows, columns) in [0, 1]: how well a point in a cell matches. Outside it is 0.
        allowed: (rows, columns) cells at which the base may be.
        resolution: side of a cell, metres.
        origin: (x, y) of the outer corner of cell (0, 0), metres.
        spacing: distance between lattice positions, metres; rounded to whole cells.
    """

    def __init__(
        self,
        values: FloatArray | NDArray[np.float32],
        allowed: NDArray[np.bool_],
        resolution: float,
        origin: tuple[float, float],
        spacing: float,
    ) -> None:
        from stack.localisation.search import kernels

        self._kernels = kernels
        factor = max(1, round(spacing / resolution))
        self.spacing = factor * resolution
        self._origin = origin
        grid = np.rint(HIGHEST * _largest(values, factor)).astype(np.uint8)
        self.shape: tuple[int, int] = (grid.shape[0], grid.shape[1])
        self._scores = build_pyramid(grid)
        self._allowed = build_pyramid(_largest(allowed, factor).astype(np.uint8))

    def search(
        self,
        points: FloatArray,
        heading_step: float,
        limits: SearchLimits,
        window: SearchWindow | None = None,
    ) -> LatticeMatches:
        """Return the distinct lattice poses at which the points match best.

        Args:
            points: (m, 2) metres, base frame.
            heading_step: largest angle between two headings of the lattice, radians.
            limits: which poses to return.
            window: poses to search; None: all positions and headings.
        """
        headings, period = self._headings(heading_step, window)
        bounds = self._bounds(window)
        if points.shape[0] == 0 or bounds[2] <= 0 or bounds[3] <= 0:
            return LatticeMatches(np.empty((0, 3)), np.empty(0), True)
        step = headings[1] - headings[0] if headings.size > 1 else heading_step
        size = int(bounds[2:].max()).bit_length()
        levels = LEVELS if window is None else min(LEVELS, max(1, size - 2))
        layout, offsets = self._scores.layout[:levels], self.offsets(points, headings)
        results, number, complete = self._kernels.search_lattice(
            self._scores.cells, layout, self._allowed.cells, offsets,
            *_precomputed(offsets, layout), bounds,
            max(1, ceil(limits.least * HIGHEST * points.shape[0])), limits.fraction,
            limits.distance / self.spacing, max(1, ceil(limits.angle / step - 1e-9)), period,
            limits.most, limits.boxes,
        )  # fmt: skip
        found = results[:number]
        poses = np.column_stack([
            self._origin[0] + (found[:, 3] + 0.5) * self.spacing,
            self._origin[1] + (found[:, 2] + 0.5) * self.spacing,
            headings[found[:, 1]],
        ])  # fmt: skip
        scores = found[:, 0] / (HIGHEST * points.shape[0])
        return LatticeMatches(poses, scores, bool(complete))

    def offsets(self, points: FloatArray, headings: FloatArray) -> NDArray[np.int32]:
        """Return (h, m, 2) rows and columns from the base's cell to the points' cells."""
        c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
        x, y = points[:, 0], points[:, 1]
        cells = np.stack([s * x + c * y, c * x - s * y], axis=-1) / self.spacing
        return np.rint(cells).astype(np.int32)

    @staticmethod
    def _headings(step: float, window: SearchWindow | None) -> tuple[FloatArray, int]:
        """Return the headings of the lattice, and their number in a full turn."""
        if window is None or window.angle >= pi - step:
            count = ceil(2.0 * pi / step - 1e-9)
            centre = 0.0 if window is None else window.centre.heading
            return centre + np.arange(count, dtype=np.float64) * (2.0 * pi / count), count
        half = ceil(window.angle / step - 1e-9)
        span = window.angle / half if half else 0.0
        around = np.arange(-half, half + 1, dtype=np.float64) * span
        return window.centre.heading + around, 8 * half + 8

    def _bounds(self, window: SearchWindow | None) -> NDArray[np.int64]:
        """Return (4,) first row, first column, rows, columns of the window within the grid."""
        if window is None:
            return np.array([0, 0, *self.shape], dtype=np.int64)
        centre = np.array([window.centre.y - self._origin[1], window.centre.x - self._origin[0]])
        first = np.floor((centre - window.distance) / self.spacing).astype(np.int64)
        last = np.floor((centre + window.distance) / self.spacing).astype(np.int64)
        first = np.clip(first, 0, np.array(self.shape))
        last = np.clip(last + 1, first, np.array(self.shape))
        return np.concatenate([first, last - first])


def _precomputed(
    offsets: NDArray[np.int32], layout: NDArray[np.int64]
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the differences of indices and the extents that the kernel needs of the offsets."""
    flat = np.stack([
        (offsets[..., 0] >> shift) * int(columns) + (offsets[..., 1] >> shift)
        for _, _, columns, shift, _ in layout
    ])  # fmt: skip
    low, high = offsets.min(axis=1), offsets.max(axis=1)
    extents = np.column_stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]])
    return flat.astype(np.int32), np.ascontiguousarray(extents)


def _largest(grid: NDArray[np.float32] | FloatArray | NDArray[np.bool_], factor: int) -> FloatArray:
    """Return the largest value in each block of `factor` x `factor` cells, as floats."""
    whole = np.asarray(grid, dtype=np.float64)
    if factor == 1:
        return whole
    rows, columns = (-size % factor for size in whole.shape)
    whole = np.pad(whole, ((0, rows), (0, columns)))
    blocks: FloatArray = whole.reshape(
        whole.shape[0] // factor, factor, whole.shape[1] // factor, factor
    ).max(axis=(1, 3))
    return blocks


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
