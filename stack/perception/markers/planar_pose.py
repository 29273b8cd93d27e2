"""Base pose on the floor from the image of upright squares.

With a known camera mount and the base on the floor, three of the camera's six unknowns remain: x, y
and heading. Gauss-Newton on the reprojection errors starts at an unconstrained solution. A fourth
unknown shifts all corners vertically in the image, so that pitch of the base does not bias the
other three. Where two mirrored solutions are close together, a full step overshoots, so the steps
are damped (K. Levenberg, 1944; D. Marquardt, 1963).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin

import numpy as np

from stack.frames.tree import inverse
from stack.types import CameraModel, FloatArray, Pose2D

_ITERATIONS = 30
_DAMPING, _LEAST = 1e-4, 1e-9
"""Damping of a step relative to the diagonal of JᵀJ, and what is added to that diagonal."""

_NEAREST = 0.05
"""Metres in front of the camera; points that are nearer have no image."""


@dataclass(frozen=True, slots=True)
class FloorFit:
    """A base pose on the floor that explains the image of some points.

    Attributes:
        pose: of the base, map frame.
        error: root mean square reprojection error of a point, pixels.
        covariance: (3, 3) of x, y, heading: (JᵀR⁻¹J)⁻¹ without the row of the vertical shift, where
            J is the Jacobian of the projection and R the noise of the pixels.
        residuals: (n, 2) pixels, seen minus expected.
        cost: rᵀR⁻¹r / 2 of the residuals r.
    """

    pose: Pose2D
    error: float
    covariance: FloatArray
    residuals: FloatArray
    cost: float


def align_on_floor(
    start: Pose2D, camera: CameraModel, corners: FloatArray, pixels: FloatArray,
    noise: FloatArray | None = None,
) -> FloorFit | None:  # fmt: skip
    """Return the base pose near `start` with the smallest reprojection error.

    Args:
        start: map frame.
        camera: intrinsics and mount.
        corners: (n, 3) in the map frame, metres; at least three points.
        pixels: (n, 2) corners in the image without its distortion, from the image's corner.
        noise: (2n, 2n) covariance of the pixels, px²; None: independent, 1 px².

    Returns:
        The fit; None if a corner is behind the camera or the corners do not determine the pose.
    """
    whiten = np.eye(2 * len(corners)) if noise is None else np.linalg.inv(np.linalg.cholesky(noise))
    unknowns = np.array([start.x, start.y, start.heading, 0.0])
    projected, damping = project(unknowns, camera, corners), _DAMPING
    for _ in range(_ITERATIONS):
        if projected is None:
            return None
        off, jacobian = whiten @ (pixels - projected[0]).ravel(), whiten @ projected[1]
        normal = jacobian.T @ jacobian
        step = np.linalg.solve(
            normal + damping * np.diag(np.diag(normal) + _LEAST), jacobian.T @ off
        )
        tried = project(unknowns + step, camera, corners)
        if tried is None or _squares(whiten, pixels - tried[0]) > off @ off:
            damping *= 10.0
            continue
        unknowns, projected, damping = unknowns + step, tried, max(0.1 * damping, _DAMPING)
        if np.abs(step).max() < 1e-7:
            break
    if projected is None:
        return None
    residuals, jacobian = pixels - projected[0], whiten @ projected[1]
    normal = jacobian.T @ jacobian
    if not np.isfinite(normal).all() or np.linalg.cond(normal) > 1e14:
        return None
    covariance = np.linalg.inv(normal)[:3, :3]
    x, y, heading = (float(value) for value in unknowns[:3])
    return FloorFit(
        Pose2D(0.0, 0.0).compose(Pose2D(x, y, heading)),
        float(np.sqrt((residuals**2).sum(axis=1).mean())),
        0.5 * (covariance + covariance.T), residuals, 0.5 * _squares(whiten, residuals),
    )  # fmt: skip


def _squares(whiten: FloatArray, residuals: FloatArray) -> float:
    off = whiten @ residuals.ravel()
    return float(off @ off)


def project(
    unknowns: FloatArray, camera: CameraModel, corners: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Project map points for a base pose.

    Args:
        unknowns: (4,) x, y, heading of the base in the map frame, and vertical shift in pixels.
        camera: intrinsics and mount.
        corners: (n, 3) map frame, metres.

    Returns:
        Pixels (n, 2) and the (2n, 4) Jacobian; None if a point is behind the camera.
    """
    x, y, heading, lift = unknowns
    c, s = cos(heading), sin(heading)
    base_from_map = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    turning = np.array([[-s, c, 0.0], [-c, -s, 0.0], [0.0, 0.0, 0.0]])
    off = corners - np.array([x, y, 0.0])
    optical_from_base = inverse(camera.base_from_optical())
    rotation = optical_from_base[:3, :3]
    points = off @ (rotation @ base_from_map).T + optical_from_base[:3, 3]
    if (points[:, 2] < _NEAREST).any():
        return None
    depth = points[:, 2]
    focal = camera.fx, camera.fy
    expected = np.array(focal) * points[:, :2] / depth[:, None]
    expected += (camera.cx, camera.cy)
    expected[:, 1] += lift
    jacobian = np.zeros((corners.shape[0], 2, 4))
    by_x = -(rotation @ base_from_map)[:, 0]
    by_y = -(rotation @ base_from_map)[:, 1]
    moved = [np.broadcast_to(by_x, points.shape), np.broadcast_to(by_y, points.shape)]
    moved.append(off @ (rotation @ turning).T)
    for column, change in enumerate(moved):
        for axis in range(2):
            slope = change[:, axis] - points[:, axis] / depth * change[:, 2]
            jacobian[:, axis, column] = focal[axis] * slope / depth
    jacobian[:, 1, 3] = 1.0
    return expected, jacobian.reshape(-1, 4)
