"""Signed distance field and likelihood field of a map."""

from __future__ import annotations

from dataclasses import dataclass
from math import floor, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from stack.geometry.distance_transform import distances_to_zero
from stack.types import FloatArray, OccupancyGrid, Pose2D

TRUNCATION = 1.0
"""Metres at which distances to surfaces are truncated."""

FINE = 0.05
"""Side of the cells of a map, metres, whose deviation is part of that of the beams."""


@dataclass(frozen=True, slots=True)
class SignedDistanceField:
    """Signed distances to the surfaces between free and occupied cells.

    Attributes:
        distances: (rows, columns) float32 metres at the cells' centres: 0 on the edge between a
            free and an occupied cell, of coarse cells `surface_depth` behind it, negative inside,
            truncated at TRUNCATION.
        occupancy: (rows, columns) uint8: 0 free, 1 occupied, 2 unknown.
        resolution: side of a cell, metres.
        origin: (x, y) of the outer corner of cell (0, 0), metres.
    """

    distances: NDArray[np.float32]
    occupancy: NDArray[np.uint8]
    resolution: float
    origin: tuple[float, float]

    @property
    def placement(self) -> tuple[float, float, float]:
        """(resolution, origin x, origin y) in metres, the kernels' arguments."""
        return (self.resolution, *self.origin)

    @property
    def surface_depth(self) -> float:
        """Mean distance of a surface behind the edge of its cells, metres; 0 for fine cells.

        A surface is anywhere within its occupied cell: half a side behind the edge, with a
        deviation of the side over the root of 12. What beams deviate from cells of FINE metres is
        part of their own deviation.
        """
        return max(self.resolution - FINE, 0.0) / 2.0

    @property
    def surface_deviation(self) -> float:
        """Standard deviation of a surface about its mean depth, metres; 0 for fine cells."""
        return sqrt(max(self.resolution**2 - FINE**2, 0.0) / 12.0)

    def is_blocked(self, pose: Pose2D) -> bool:
        """Return whether a pose is in an occupied cell or outside the grid."""
        column = floor((pose.x - self.origin[0]) / self.resolution)
        row = floor((pose.y - self.origin[1]) / self.resolution)
        rows, columns = self.occupancy.shape
        if not (0 <= row < rows and 0 <= column < columns):
            return True
        return bool(self.occupancy[row, column] == 1)

    def are_clear(self, points: FloatArray, clearance: FloatArray) -> NDArray[np.bool_]:
        """Return which points (n, 2), metres, are in free cells with the clearance (n,), metres."""
        cells = np.floor((points - self.origin) / self.resolution).astype(np.int64)
        rows, columns = self.occupancy.shape
        inside = (cells[:, 0] >= 0) & (cells[:, 0] < columns)
        inside &= (cells[:, 1] >= 0) & (cells[:, 1] < rows)
        column, row = np.where(inside[:, None], cells, 0).T
        free = inside & (self.occupancy[row, column] == 0)
        clear: NDArray[np.bool_] = free & (self.distances[row, column] >= clearance)
        return clear

    def log_likelihoods(self, deviation: float, hit_share: float) -> NDArray[np.float32]:
        """Return (rows, columns) float32: log of the likelihood field's mixture, 0 on a surface.

        Probabilistic Robotics, 2005, section 6.4: the share `hit_share` of the returns is normally
        distributed about a surface, the rest is uniform. The uniform part limits the penalty of a
        return that the map does not explain.

        Args:
            deviation: standard deviation of a hit, metres; that of coarse cells is added.
            hit_share: in (0, 1).
        """
        deviation = hypot(deviation, self.surface_deviation)

        def mixture(distances: NDArray[np.float32]) -> NDArray[np.float32]:
            hit = np.exp(-0.5 * (distances.astype(np.float64) / deviation) ** 2)
            return np.log(hit_share * hit + (1.0 - hit_share)).astype(np.float32)

        far = np.array([TRUNCATION], dtype=np.float32)
        table = np.full(self.distances.shape, mixture(far)[0])
        near = self.distances < TRUNCATION
        table[near] = mixture(self.distances[near])
        return table

    def are_free(self, clearance: float, stride: int = 1, first: int = 0) -> NDArray[np.bool_]:
        """Return (rows, columns): free cells with this clearance in metres.

        Args:
            clearance: metres to the next surface.
            stride: only every `stride`-th row and column.
            first: the first row and column.
        """
        chosen = (slice(first, None, stride),) * 2
        free: NDArray[np.bool_] = self.occupancy[chosen] == 0
        free &= self.distances[chosen] >= clearance
        return free

    def free_cells(self, clearance: float) -> NDArray[np.int64]:
        """Return (n,) indices, row * columns + column, of free cells with this clearance."""
        cells: NDArray[np.int64] = np.flatnonzero(self.are_free(clearance))
        return cells

    def centres(self, cells: NDArray[np.int64]) -> FloatArray:
        """Return (n, 2) x, y in metres of the centres of cells (n,), row * columns + column."""
        row, column = np.divmod(cells, self.distances.shape[1])
        middles: FloatArray = np.column_stack([column, row]).astype(np.float64)
        middles += 0.5
        middles *= self.resolution
        middles += self.origin
        return middles


def alignment_variance(noise: float) -> float:
    """Return the variance of a return about the map's surface when a scan is aligned, m².

    5 cm with a noise of 1 cm: far above the lidar's own, since the errors of beams are related.

    Args:
        noise: standard deviation of a range of the lidar, metres.
    """
    return noise**2 + (0.05**2 - 0.01**2)


def surface_field(grid: OccupancyGrid) -> SignedDistanceField:
    """Compute the signed distance field of an occupancy grid by an exact Euclidean transform."""
    occupied, free = grid.occupied, grid.free

    def to_nearest(goal: NDArray[np.bool_]) -> NDArray[np.float32]:
        cells = distances_to_zero(~goal)
        nearest = np.full(goal.shape, TRUNCATION, dtype=np.float32)
        near = cells < TRUNCATION / grid.resolution + 1.0
        nearest[near] = np.minimum((cells[near] - 0.5) * grid.resolution, TRUNCATION)
        return nearest

    distances = to_nearest(occupied)
    np.copyto(distances, -to_nearest(free), where=occupied)
    occupancy = np.full(occupied.shape, 2, dtype=np.uint8)
    occupancy[free] = 0
    occupancy[occupied] = 1
    field = SignedDistanceField(distances, occupancy, grid.resolution, grid.origin)
    if field.surface_depth > 0.0:
        distances += np.float32(field.surface_depth)
        np.minimum(distances, np.float32(TRUNCATION), out=distances)
    return field
