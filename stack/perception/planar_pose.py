"""Base pose on the floor from the image of an upright square.

With a known camera mount and the base on the floor, three of the camera's six unknowns remain: x, y
and heading. Gauss-Newton on the reprojection errors starts at an unconstrained solution. A fourth
unknown shifts all corners vertically in the image, so that pitch of the base does not bias the
other three.
"""

from __future__ import annotations

from math import cos, sin

import numpy as np

from stack.types import CameraModel, FloatArray, Pose2D

_ITERATIONS = 15


def align_on_floor(
    start: Pose2D, camera: CameraModel, corners: FloatArray, pixels: FloatArray
) -> tuple[Pose2D, float] | None:
    """Return the base pose near `start` with the smallest reprojection error, and that error.

    Args:
        start: map frame.
        camera: intrinsics and mount.
        corners: (4, 3) in the map frame, metres.
        pixels: (4, 2) corners in the image, from the image's corner.

    Returns:
        The pose in the map frame and its root mean square reprojection error in pixels; None if a
        corner is behind the camera or the corners do not determine the pose.
    """
    optical_from_base = np.asarray(np.linalg.inv(camera.base_from_optical()), dtype=np.float64)
    unknowns = np.array([start.x, start.y, start.heading, 0.0])
    for _ in range(_ITERATIONS):
        projected = project(unknowns, optical_from_base, camera, corners)
        if projected is None:
            return None
        expected, jacobian = projected
        normal = jacobian.T @ jacobian
        if np.linalg.cond(normal) > 1e14:
            return None
        step = np.linalg.solve(normal, jacobian.T @ (pixels - expected).ravel())
        unknowns += step
        if np.abs(step).max() < 1e-7:
            break
    projected = project(unknowns, optical_from_base, camera, corners)
    if projected is None:
        return None
    error = float(np.sqrt(((pixels - projected[0]) ** 2).sum(axis=1).mean()))
    x, y, heading = (float(value) for value in unknowns[:3])
    return Pose2D(0.0, 0.0).compose(Pose2D(x, y, heading)), error


def project(
    unknowns: FloatArray, optical_from_base: FloatArray, camera: CameraModel, corners: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Project map points for a base pose.

    Args:
        unknowns: (4,) x, y, heading of the base in the map frame, and vertical shift in pixels.
        optical_from_base: (4, 4).
        camera: intrinsics.
        corners: (n, 3) map frame, metres.

    Returns:
        Pixels (n, 2) and the (2n, 4) Jacobian; None if a point is behind the camera.
    """
    x, y, heading, lift = unknowns
    c, s = cos(heading), sin(heading)
    base_from_map = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    turning = np.array([[-s, c, 0.0], [-c, -s, 0.0], [0.0, 0.0, 0.0]])
    off = corners - np.array([x, y, 0.0])
    rotation = optical_from_base[:3, :3]
    points = off @ (rotation @ base_from_map).T + optical_from_base[:3, 3]
    if (points[:, 2] < 0.05).any():
        return None
    depth = points[:, 2]
    focal = camera.focal_length
    expected = focal * points[:, :2] / depth[:, None]
    expected += (camera.width / 2.0, camera.height / 2.0)
    expected[:, 1] += lift
    jacobian = np.zeros((corners.shape[0], 2, 4))
    by_x = -(rotation @ base_from_map)[:, 0]
    by_y = -(rotation @ base_from_map)[:, 1]
    moved = [np.broadcast_to(by_x, points.shape), np.broadcast_to(by_y, points.shape)]
    moved.append(off @ (rotation @ turning).T)
    for column, change in enumerate(moved):
        for axis in range(2):
            slope = change[:, axis] - points[:, axis] / depth * change[:, 2]
            jacobian[:, axis, column] = focal * slope / depth
    jacobian[:, 1, 3] = 1.0
    return expected, jacobian.reshape(-1, 4)
