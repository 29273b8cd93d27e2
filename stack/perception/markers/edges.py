"""Subpixel corners of a dark square on a bright board, accurate to a few hundredths of a pixel.

Edges have more pixels than corners. Brightness profiles are sampled across each side; the centre of
a profile's rise is a point on the edge. A line is fitted to the points of each side, and adjacent
lines intersect in the corners (as AprilTag refines its quads; J. Wang, E. Olson, "AprilTag 2:
Efficient and Robust Fiducial Detection", IROS 2016).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from stack.types import FloatArray

_PROFILES = 24
_STEP = 0.25
_ROUNDS = 3


InPicture = Callable[[FloatArray], FloatArray]


def refine_corners(
    grey: NDArray[np.uint8], corners: FloatArray, cells: int, in_picture: InPicture | None = None
) -> FloatArray:
    """Refine the corners (4, 2) of a marker's black square.

    A lens bends the sides. With `in_picture` lines are fitted, and corners returned, where a camera
    without distortion sees them.

    Args:
        grey: (height, width) brightness.
        corners: (4, 2) pixels, (0, 0) at a pixel centre, in order; accurate to one or two pixels.
        cells: cells along a side, including the black border. A profile reaches half a cell to each
            side of the edge, and stays within a white margin of an eighth of the side.
        in_picture: returns the pixels (n, 2) of `grey` that show points (n, 2) without distortion.
    """
    refined = corners
    for _ in range(_ROUNDS):
        side = np.linalg.norm(np.roll(refined, -1, axis=0) - refined, axis=1).min()
        reach = float(np.clip(0.5 * side / cells, 1.25, 4.0))
        lines = [
            _edge_line(
                grey, (refined[i], refined[(i + 1) % 4]), refined.mean(axis=0), reach, in_picture
            )
            for i in range(4)
        ]
        met = np.array([_intersection(lines[i - 1], lines[i]) for i in range(4)])
        # A partly hidden board has no edge to fit: keep the initial corners.
        if not np.isfinite(met).all() or np.abs(met - corners).max() > 3.0:
            return corners
        refined = met
    return refined


def _edge_line(
    grey: NDArray[np.uint8], ends: tuple[FloatArray, FloatArray], middle: FloatArray, reach: float,
    in_picture: InPicture | None,
) -> tuple[FloatArray, float]:  # fmt: skip
    """Fit the line n·p = d of the edge between two corners; n is its outward unit normal."""
    import cv2

    start, end = ends
    direction = (end - start) / np.linalg.norm(end - start)
    normal = np.array([direction[1], -direction[0]])
    if normal @ (middle - start) > 0.0:
        normal = -normal
    along = np.linspace(0.12, 0.88, _PROFILES)[:, None]
    on_edge = start + along * (end - start)
    offsets = np.arange(-reach, reach + _STEP / 2, _STEP)
    points = on_edge[:, None, :] + offsets[None, :, None] * normal
    if in_picture is not None:
        points = in_picture(points.reshape(-1, 2)).reshape(points.shape)
    maps = points.astype(np.float32)
    profiles = cv2.remap(
        grey, maps[..., 0], maps[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    ).astype(np.float64)
    rises = np.maximum(np.diff(profiles, axis=1), 0.0)
    centres = (offsets[1:] + offsets[:-1]) / 2.0
    contrast = rises.sum(axis=1)
    if contrast.max() < 20.0:
        return normal, np.nan
    shifts = rises @ centres / np.maximum(contrast, 1.0)
    edge_points = on_edge + shifts[:, None] * normal
    return _fitted(edge_points, contrast, normal)


def _fitted(
    points: FloatArray, weights: FloatArray, outward: FloatArray
) -> tuple[FloatArray, float]:
    """Fit a line to points (n, 2) by weighted total least squares."""
    centre = weights @ points / weights.sum()
    off = points - centre
    across = np.linalg.eigh((off * weights[:, None]).T @ off)[1][:, 0]
    normal: FloatArray = across if across @ outward > 0.0 else -across
    return normal, float(normal @ centre)


def _intersection(one: tuple[FloatArray, float], other: tuple[FloatArray, float]) -> FloatArray:
    normals = np.array([one[0], other[0]])
    if abs(np.linalg.det(normals)) < 1e-3:
        return np.full(2, np.nan)
    point: FloatArray = np.linalg.solve(normals, np.array([one[1], other[1]]))
    return point
