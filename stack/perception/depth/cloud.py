"""Points of a depth picture, one for each voxel."""

from __future__ import annotations

from functools import lru_cache
from math import ceil

import numpy as np
from numpy.typing import NDArray

from stack.geometry.voxels import voxel_keys
from stack.types import CameraModel, DepthImage, FloatArray, PointCloud

WIDEST = 320
"""Columns of a picture that are used; of wider ones every second, third… row and column."""


def point_cloud(
    image: DepthImage, *, voxel: float = 0.05, above: float | None = None, least_pixels: int = 1
) -> PointCloud:
    """Return the points of a picture in the base frame, the mean of each voxel.

    Args:
        image: of a depth camera.
        voxel: side of a voxel, metres.
        above: height in metres; lower points, such as the ground, are removed. None: keep all.
        least_pixels: pixels in a voxel that make a point.
    """
    depth = used_pixels(image)
    valid = (depth >= image.range_min) & (depth <= image.range_max)
    points = np.array(image.camera.position) + depth[valid, None] * rays(image.camera)[valid]
    if above is not None:
        points = points[points[:, 2] > above]
    return PointCloud(image.stamp, voxel_means(points, voxel, least_pixels))


def decimation(camera: CameraModel) -> int:
    """Return the number of rows and columns from one used pixel to the next."""
    return max(1, ceil(camera.width / WIDEST))


def used_pixels(image: DepthImage) -> NDArray[np.float32]:
    """Return (rows, columns) the depths of the used pixels of a picture, metres."""
    step = decimation(image.camera)
    return image.depth[step // 2 :: step, step // 2 :: step]


@lru_cache(maxsize=8)
def rays(camera: CameraModel) -> FloatArray:
    """Return (rows, columns, 3) points at depth 1 m of the used pixels, seen from the camera."""
    step = decimation(camera)
    shown = camera.rays(camera.pixel_centres()).reshape(camera.height, camera.width, 2)
    shown = shown[step // 2 :: step, step // 2 :: step]
    optical = np.ones((*shown.shape[:2], 3))
    optical[:, :, :2] = shown
    found: FloatArray = optical @ camera.base_from_optical()[:3, :3].T
    found.setflags(write=False)
    return found


def voxel_means(points: FloatArray, side: float, least: int) -> FloatArray:
    """Return (m, 3) the mean point of each voxel that holds enough points.

    The voxel filter of R. B. Rusu and S. Cousins, "3D is here: Point Cloud Library (PCL)", IEEE
    ICRA 2011.

    Args:
        points: (n, 3) metres.
        side: of a voxel, metres.
        least: number of points.
    """
    if not len(points):
        return points
    keys, columns = voxel_keys(points, side), np.ascontiguousarray(points.T)
    # Neighbouring pixels are mostly in the same voxel: add up such runs before sorting.
    runs = _starts(keys)
    keys, counts, sums = keys[runs], np.diff(runs, append=len(keys)), _sums(columns, runs)
    order = np.argsort(keys, kind="stable")
    first = _starts(keys[order])
    counts = np.add.reduceat(counts[order], first)
    dense = counts >= least
    means: FloatArray = (_sums(sums[:, order], first)[:, dense] / counts[dense]).T
    return means


def _starts(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the index of the first of each run of equal keys."""
    return np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]]))


def _sums(columns: FloatArray, starts: NDArray[np.int64]) -> FloatArray:
    """Return (3, m) the sums of (3, n) from each start to the next."""
    found: FloatArray = np.add.reduceat(columns, starts, axis=1)
    return found
