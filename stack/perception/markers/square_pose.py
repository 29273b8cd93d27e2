"""Base poses from the corners of single square markers.

The camera's pose is computed by IPPE for squares (T. Collins, A. Bartoli, "Infinitesimal
Plane-Based Pose Estimation", IJCV 109, 2014). A distant square has two poses with nearly the same
image, mirrored at the line of sight. Both are returned.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import acos, cos, sin

import numpy as np

from stack.frames.tree import inverse
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.planar_pose import FloorFit, align_on_floor
from stack.types import CameraModel, FloatArray, Marker, Pose2D, PoseCandidate, on_floor

LARGEST_HEIGHT_ERROR = 0.3
"""Metres; largest height of a solution's base above or below the floor."""

LARGEST_TILT = 0.52
"""Radians (30 degrees); largest tilt of a solution's base against the floor."""

LARGEST_CORRECTION = 0.5
"""Metres; larger corrections by the floor constraint are rejected as divergence."""

SAME_POSE = 0.02
"""Metres; solutions closer than this after the floor constraint are the same."""

_EVIDENCE = 0.2
"""Exponent of the likelihood by which two solutions are compared: the errors of the corners are
mostly those of pixels' stairs, which all corners of a side share."""


@dataclass(frozen=True, slots=True)
class SquareSolution:
    """A pose of a marker in the camera's optical frame.

    Attributes:
        optical_from_marker: (4, 4).
        error: reprojection error, pixels.
    """

    optical_from_marker: FloatArray
    error: float

    @property
    def distance(self) -> float:
        """Metres from the camera."""
        return float(np.linalg.norm(self.optical_from_marker[:3, 3]))


def square_solutions(size: float, camera: CameraModel, pixels: FloatArray) -> list[SquareSolution]:
    """Return both IPPE solutions of a square's corners (4, 2) in the image, the better one first.

    Args:
        size: side of the square, metres.
        camera: intrinsics.
        pixels: corners from the image's corner, clockwise from the top left one.
    """
    import cv2

    count, rotations, translations, errors = cv2.solvePnPGeneric(
        square(size), pixels, camera.matrix, None, flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    found = []
    for i in range(count):
        optical_from_marker = np.eye(4)
        optical_from_marker[:3, :3] = cv2.Rodrigues(rotations[i])[0]
        optical_from_marker[:3, 3] = np.ravel(translations[i])
        if np.isfinite(optical_from_marker).all():
            found.append(SquareSolution(optical_from_marker, float(errors[i][0])))
    return sorted(found, key=lambda solution: solution.error)


def square(size: float) -> FloatArray:
    """Return the corners (4, 3) of a marker in its own frame: x right, y up, z out of it."""
    half = size / 2.0
    # IPPE_SQUARE requires this order
    return np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])


def mean_side(corners: FloatArray) -> float:
    """Return the mean length of the sides of a square's corners (4, 2), pixels."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    return float(sides.mean())


def map_from_marker(marker: Marker) -> FloatArray:
    """Return the (4, 4) transform from a marker's frame (x right, y up, z out) to the map frame."""
    c, s = cos(marker.heading), sin(marker.heading)
    transform = np.eye(4)
    # Seen from the front, the marker's right is to the left of the direction it faces.
    transform[:3, 0] = [-s, c, 0.0]
    transform[:3, 1] = [0.0, 0.0, 1.0]
    transform[:3, 2] = [c, s, 0.0]
    transform[:3, 3] = marker.position
    return transform


def corners_in_map(marker: Marker) -> FloatArray:
    """Return the corners (4, 3) of a marker in the map frame, metres."""
    transform = map_from_marker(marker)
    corners: FloatArray = square(marker.size) @ transform[:3, :3].T + transform[:3, 3]
    return corners


def base_candidates(
    marker: Marker, camera: CameraModel, pixels: FloatArray, parameters: MarkerParameters
) -> tuple[float, tuple[PoseCandidate, ...]] | None:
    """Return a marker's distance from the camera and the base's poses on the floor that explain it.

    The better pose comes first. None without a solution.

    Args:
        marker: map frame.
        camera: intrinsics and mount.
        pixels: (4, 2) its corners, from the image's corner.
        parameters: noise.
    """
    solutions = square_solutions(marker.size, camera, pixels)
    placed = [_in_map(marker, camera, solution) for solution in solutions]
    if not placed:
        return None
    upright = [(one, pose) for one, (pose, is_upright) in zip(solutions, placed, strict=True)
               if is_upright]  # fmt: skip
    kept = upright or [(one, pose) for one, (pose, _) in zip(solutions, placed, strict=True)]
    fits: list[FloorFit] = []
    corners, noise = corners_in_map(marker), parameters.pixel_noise**2 * np.eye(8)
    for _, pose in kept:
        fit = align_on_floor(pose, camera, corners, pixels, noise)
        if fit is None or fit.pose.distance_to(pose) >= LARGEST_CORRECTION:
            continue
        if all(other.pose.distance_to(fit.pose) > SAME_POSE for other in fits):
            fits.append(fit)
    if not fits:
        loose = [PoseCandidate(pose, one.error, share=1.0 / len(kept)) for one, pose in kept]
        return kept[0][0].distance, tuple(loose)
    return kept[0][0].distance, candidates_of(fits, parameters)


def shared_covariance(parameters: MarkerParameters) -> FloatArray:
    """Return the covariance (3, 3) of x, y and heading that all pictures share: the mount."""
    position, angle = parameters.mount_deviation, parameters.mount_angle_deviation
    covariance: FloatArray = np.diag(np.square([position, position, angle]))
    return covariance


def candidates_of(fits: list[FloorFit], parameters: MarkerParameters) -> tuple[PoseCandidate, ...]:
    """Return fits of the same corners as candidates, with covariances, the most probable first."""
    costs = np.array([fit.cost for fit in fits])
    shares = np.exp(-_EVIDENCE * (costs - costs.min()))
    shares /= shares.sum()
    common = shared_covariance(parameters)
    found = [
        PoseCandidate(fit.pose, fit.error, fit.covariance + common, float(share))
        for fit, share in zip(fits, shares, strict=True)
    ]
    return tuple(sorted(found, key=lambda candidate: candidate.error))


def _in_map(marker: Marker, camera: CameraModel, solution: SquareSolution) -> tuple[Pose2D, bool]:
    """Return the base's pose by a solution, and whether it stands upright on the floor."""
    base_from_marker = camera.base_from_optical() @ solution.optical_from_marker
    map_from_base = map_from_marker(marker) @ inverse(base_from_marker)
    tilt = acos(min(1.0, max(-1.0, float(map_from_base[2, 2]))))
    is_upright = abs(map_from_base[2, 3]) <= LARGEST_HEIGHT_ERROR and tilt <= LARGEST_TILT
    return on_floor(map_from_base), bool(is_upright)
