"""Geometric verification: the base pose on the floor from which a picture shows landmarks.

A pose with all six unknowns is drawn from four pairs at a time (P3P in RANSAC; M. Fischler, R.
Bolles, "Random sample consensus", CACM 24, 1981). It starts the fit of the pose on the floor; the
inliers are counted and the pose is fitted in turn. OpenCV's RANSAC draws from a generator with a
fixed start, so the same pairs give the same pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos

import numpy as np
from numpy.typing import NDArray

from stack.frames.tree import inverse, on_floor
from stack.perception.markers.planar_pose import align_on_floor, project
from stack.types import CameraModel, FloatArray, Pose2D

DRAWS, CONFIDENCE = 400, 0.999
LEAST_PAIRS = 6
LARGEST_HEIGHT, LARGEST_TILT = 0.4, 0.6
"""Metres and radians that the drawn pose may be off the floor: it is only a start."""

ROUNDS = 3
"""Times that the inliers are counted again."""

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
    pose, lift = start, 0.0
    for factor in np.linspace(3.0, 1.0, ROUNDS):
        inliers = _errors(pose, lift, camera, pixels, landmarks) <= factor * largest_error
        if inliers.sum() < LEAST_PAIRS:
            return None
        fit = align_on_floor(pose, camera, landmarks[inliers], pixels[inliers])
        if fit is None:
            return None
        pose, lift = fit.pose, fit.lift
    errors = _errors(pose, lift, camera, pixels, landmarks)
    inliers = errors <= largest_error
    if inliers.sum() < LEAST_PAIRS:
        return None
    return FloorPose(
        pose, inliers, float(np.sqrt((errors[inliers] ** 2).mean())),
        float(np.sqrt(np.linalg.eigvalsh(fit.covariance[:2, :2])[-1])),
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
    pose: Pose2D, lift: float, camera: CameraModel, pixels: FloatArray, landmarks: FloatArray
) -> FloatArray:
    """Return the (n,) reprojection errors, pixels; infinite for landmarks behind the camera."""
    errors = np.full(len(pixels), np.inf)
    ahead = np.column_stack([pose.inverse().transform(landmarks[:, :2]), landmarks[:, 2]])
    forward = camera.base_from_optical()[:3, 2]
    before = (ahead - camera.position) @ forward > NEAREST
    unknowns = np.array([pose.x, pose.y, pose.heading, lift])
    projected = project(unknowns, camera, landmarks[before])
    if projected is not None:
        errors[before] = np.linalg.norm(pixels[before] - projected[0], axis=1)
    return errors
