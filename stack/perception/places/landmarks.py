"""Positions of features from the range sensors: landmarks on upright surfaces.

A planar lidar measures how far the walls are at each bearing. What the camera sees at a bearing is
taken to be on the same upright surface, above or below the lidar's plane: pictures hang on walls.
This is wrong for what is seen above a low object or below a table, and at the edges of objects.
Edges are left out here; `Keyframe.kept` drops what other keyframes contradict.
"""

from __future__ import annotations

import numpy as np

from stack.types import CameraModel, FloatArray

LONGEST_GAP = 0.35
"""Metres between two neighbouring range points on one surface."""

WIDEST_GAP = 0.07
"""Radians between the bearings of two neighbouring range points."""

LOWEST, HIGHEST = 0.05, 3.0
"""Heights between which landmarks lie, metres; the floor's texture repeats."""

NEAREST, FARTHEST = 0.3, 8.0
"""Distances of landmarks from the camera along the floor, metres."""


def landmarks(pixels: FloatArray, camera: CameraModel, points: FloatArray) -> FloatArray:
    """Return the positions of features in the base frame.

    Args:
        pixels: (n, 2) features, from the image's corner.
        camera: intrinsics and mount.
        points: (m, 2) of a range sensor at the time of the picture, base frame, metres.

    Returns:
        (n, 3) metres; NaN where the range sensor shows no surface.
    """
    found = np.full((len(pixels), 3), np.nan)
    if len(points) < 2 or not len(pixels):
        return found
    rays = _rays(pixels, camera)
    origin = np.array(camera.position)
    bearings = np.arctan2(rays[:, 1], rays[:, 0])
    distances = _distances(bearings, points - origin[:2])
    flat = np.hypot(rays[:, 0], rays[:, 1])
    reach = distances / np.maximum(flat, 1e-9)
    positions = origin + rays * reach[:, None]
    with np.errstate(invalid="ignore"):
        good = (positions[:, 2] >= LOWEST) & (positions[:, 2] <= HIGHEST)
        good &= (distances >= NEAREST) & (distances <= FARTHEST)
    found[good] = positions[good]
    return found


def _rays(pixels: FloatArray, camera: CameraModel) -> FloatArray:
    """Return the (n, 3) directions of undistorted pixels in the base frame."""
    seen = (pixels - [camera.cx, camera.cy]) / [camera.fx, camera.fy]
    optical = np.column_stack([seen, np.ones(len(pixels))])
    rays: FloatArray = optical @ camera.base_from_optical()[:3, :3].T
    return rays


def _distances(bearings: FloatArray, points: FloatArray) -> FloatArray:
    """Return how far the surface is at bearings from the origin; NaN where there is none.

    Neighbouring points (m, 2) that are close together are joined by a straight surface.
    """
    around = np.arctan2(points[:, 1], points[:, 0])
    order = np.argsort(around, kind="stable")
    around, points = around[order], points[order]
    after = np.searchsorted(around, bearings, side="right") % len(points)
    before = after - 1
    a, b = points[before], points[after]
    gap = np.hypot(*(b - a).T)
    turn = (around[after] - around[before]) % (2.0 * np.pi)
    c, s = np.cos(bearings), np.sin(bearings)
    # The ray t (c, s) meets the line a + k (b - a) where t = (a x (b - a)) / ((c, s) x (b - a)).
    edge = b - a
    across = c * edge[:, 1] - s * edge[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        distances = (a[:, 0] * edge[:, 1] - a[:, 1] * edge[:, 0]) / across
    joined = (gap <= LONGEST_GAP) & (turn <= WIDEST_GAP) & (np.abs(across) > 1e-9)
    return np.where(joined & (distances > 0.0), distances, np.nan)
