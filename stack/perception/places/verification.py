"""Geometric verification: the base pose on the floor from which a picture shows landmarks.

A pose with all six unknowns is drawn from four pairs at a time (P3P in RANSAC; M. Fischler, R.
Bolles, "Random sample consensus", CACM 24, 1981). It starts Gauss-Newton on the pose on the floor,
which counts and refines the inliers in turn. OpenCV's RANSAC draws from a generator with a fixed
start, so the same pairs give the same pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos

import numpy as np
from numpy.typing import NDArray

from stack.frames.tree import inverse
from stack.perception.markers.planar_pose import project
from stack.types import CameraModel, FloatArray, Pose2D, on_floor

DRAWS, CONFIDENCE = 400, 0.999
LEAST_PAIRS = 6
LARGEST_HEIGHT, LARGEST_TILT = 0.4, 0.6
"""Metres and radians that the drawn pose may be off the floor: it is only a start."""

STEPS, ROUNDS = 10, 3
"""Steps of Gauss-Newton, and times that the inliers are counted again."""

NEAREST = 0.1
"""Metres in front of the camera; landmarks that are nearer are not seen."""


@dataclass(frozen=True, slots=True)
class FloorPose:
    """A base pose on the floor and the landmarks that agree.

    Attributes:
        pose: map frame.
        inliers: (n,) which pairs agree.
        error: root mean square reprojection error of these, pixels.
        deviation: standard deviation of the position in its least certain direction, metres, for
            pixels with a standard deviation of 1.
    """

    pose: Pose2D
    inliers: NDArray[np.bool_]
    error: float
    deviation: float


def verified(
    pixels: FloatArray, landmarks: FloatArray, camera: CameraModel, largest_error: float
) -> FloorPose | None:
    """Return the base pose on which most pairs agree; None if fewer than LEAST_PAIRS do.

    Args:
        pixels: (n, 2) features, from the image's corner.
        landmarks: (n, 3) the landmark of each feature, map frame, metres.
        camera: intrinsics and mount.
        largest_error: reprojection error of an inlier, pixels.
    """
    if len(pixels) < LEAST_PAIRS:
        return None
    start = _drawn(pixels, landmarks, camera, largest_error)
    return None if start is None else refined(start, pixels, landmarks, camera, largest_error)


def refined(
    start: Pose2D, pixels: FloatArray, landmarks: FloatArray, camera: CameraModel,
    largest_error: float,
) -> FloorPose | None:  # fmt: skip
    """Return the base pose near `start` on which pairs agree; arguments as for `verified`.

    The inliers are counted with a wide limit first, which narrows to `largest_error`.
    """
    unknowns = np.array([start.x, start.y, start.heading, 0.0])
    for factor in np.linspace(3.0, 1.0, ROUNDS):
        errors = _errors(unknowns, camera, pixels, landmarks)
        inliers = errors <= factor * largest_error
        if inliers.sum() < LEAST_PAIRS:
            return None
        moved = _gauss_newton(unknowns, camera, pixels[inliers], landmarks[inliers])
        if moved is None:
            return None
        unknowns, normal = moved
    errors = _errors(unknowns, camera, pixels, landmarks)
    inliers = errors <= largest_error
    if inliers.sum() < LEAST_PAIRS:
        return None
    spread = np.linalg.inv(normal)[:2, :2]
    x, y, heading = (float(value) for value in unknowns[:3])
    return FloorPose(
        Pose2D(0.0, 0.0).compose(Pose2D(x, y, heading)), inliers,
        float(np.sqrt((errors[inliers] ** 2).mean())),
        float(np.sqrt(np.linalg.eigvalsh(0.5 * (spread + spread.T))[-1])),
    )  # fmt: skip


def _drawn(
    pixels: FloatArray, landmarks: FloatArray, camera: CameraModel, largest_error: float
) -> Pose2D | None:
    """Return the pose of RANSAC, brought to the floor; None if it is far from it."""
    import cv2

    found, rotation, translation, inliers = cv2.solvePnPRansac(
        landmarks, pixels, camera.matrix, None, iterationsCount=DRAWS,
        reprojectionError=1.5 * largest_error, confidence=CONFIDENCE, flags=cv2.SOLVEPNP_P3P,
    )  # fmt: skip
    if not found or inliers is None or len(inliers) < LEAST_PAIRS:
        return None
    optical_from_map = np.eye(4)
    optical_from_map[:3, :3] = cv2.Rodrigues(rotation)[0]
    optical_from_map[:3, 3] = np.ravel(translation)
    if not np.isfinite(optical_from_map).all():
        return None
    map_from_base = inverse(camera.base_from_optical() @ optical_from_map)
    tilt = acos(min(1.0, max(-1.0, float(map_from_base[2, 2]))))
    if abs(float(map_from_base[2, 3])) > LARGEST_HEIGHT or tilt > LARGEST_TILT:
        return None
    return on_floor(map_from_base)


def _errors(
    unknowns: FloatArray, camera: CameraModel, pixels: FloatArray, landmarks: FloatArray
) -> FloatArray:  # fmt: skip
    """Return the (n,) reprojection errors, pixels; infinite for landmarks behind the camera."""
    errors = np.full(len(pixels), np.inf)
    x, y, heading = unknowns[:3]
    ahead = Pose2D(float(x), float(y), float(heading)).inverse().transform(landmarks[:, :2])
    forward = camera.base_from_optical()[:3, 2]
    before = (np.column_stack([ahead, landmarks[:, 2]]) - camera.position) @ forward > NEAREST
    projected = project(unknowns, camera, landmarks[before])
    if projected is not None:
        errors[before] = np.linalg.norm(pixels[before] - projected[0], axis=1)
    return errors


def _gauss_newton(
    unknowns: FloatArray, camera: CameraModel, pixels: FloatArray, landmarks: FloatArray
) -> tuple[FloatArray, FloatArray] | None:  # fmt: skip
    """Return the unknowns with the smallest reprojection error near these, and JᵀJ."""
    for _ in range(STEPS):
        projected = project(unknowns, camera, landmarks)
        if projected is None:
            return None
        expected, jacobian = projected
        normal = jacobian.T @ jacobian
        if not np.isfinite(normal).all() or np.linalg.cond(normal) > 1e14:
            return None
        step = np.linalg.solve(normal, jacobian.T @ (pixels - expected).ravel())
        unknowns = unknowns + step
        if np.abs(step).max() < 1e-6:
            break
    return unknowns, normal
