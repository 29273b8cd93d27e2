"""Robot poses from known fiducial markers in images.

Markers are detected with OpenCV's ArucoDetector (S. Garrido-Jurado et al., Pattern Recognition 47,
2014); the camera's pose is computed by IPPE for squares (T. Collins, A. Bartoli, "Infinitesimal
Plane-Based Pose Estimation", IJCV 109, 2014). A distant square has two poses with nearly the same
image, mirrored at the line of sight. Both are returned; a caller with a prior selects one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import acos, atan2, cos, sin
from typing import Any

import numpy as np

from stack.errors import InputError
from stack.parameters import suggestion
from stack.perception.edges import refine_corners
from stack.perception.planar_pose import align_on_floor
from stack.types import (
    CameraModel,
    FloatArray,
    Image,
    Marker,
    MarkerSighting,
    Pose2D,
    PoseCandidate,
)

LARGEST_HEIGHT_ERROR = 0.3
"""Metres; largest height of a solution's base above or below the floor."""

LARGEST_TILT = 0.52
"""Radians (30 degrees); largest tilt of a solution's base against the floor."""


LARGEST_CORRECTION = 0.5
"""Metres; larger corrections by the floor constraint are rejected as divergence."""

SAME_POSE = 0.02
"""Metres; solutions closer than this after the floor constraint are the same."""


@dataclass(frozen=True, slots=True)
class _Solution:
    """Base pose in the map frame with its height error and tilt against the floor."""

    candidate: PoseCandidate
    distance: float
    height_error: float
    tilt: float

    @property
    def is_upright(self) -> bool:
        return self.height_error <= LARGEST_HEIGHT_ERROR and self.tilt <= LARGEST_TILT


class MarkerDetector:
    """Detector of known markers in camera images."""

    def __init__(self, markers: Sequence[Marker]) -> None:
        """Create a detector for the markers of a map.

        Args:
            markers: map frame; numbers are unique within a dictionary.

        Raises:
            InputError: OpenCV does not have a marker's dictionary.
        """
        self._known = {(marker.dictionary, marker.number): marker for marker in markers}
        names = sorted({marker.dictionary for marker in markers})
        self._detectors = {name: _detector(name) for name in names}
        self._last: tuple[Image, tuple[MarkerSighting, ...]] | None = None

    def sightings(self, image: Image) -> tuple[MarkerSighting, ...]:
        """Return the known markers in an image, nearest first, with their possible base poses.

        The same image is searched only once.
        """
        if self._last is None or self._last[0] is not image:
            self._last = image, self._detect(image)
        return self._last[1]

    def _detect(self, image: Image) -> tuple[MarkerSighting, ...]:
        found = []
        grey = _grey(image)
        for dictionary, detector in self._detectors.items():
            corners, numbers, _ = detector.detectMarkers(grey)
            if numbers is None:
                continue
            for quad, number in zip(corners, np.ravel(numbers), strict=True):
                marker = self._known.get((dictionary, int(number)))
                if marker is not None:
                    cells = int(detector.getDictionary().markerSize) + 2
                    rough = np.reshape(quad, (4, 2)).astype(float)
                    refined = _refined(grey, rough, cells, image.camera)
                    found.append(_sighting(image, marker, refined))
        seen = [sighting for sighting in found if sighting is not None]
        return tuple(sorted(seen, key=lambda s: (s.distance, s.marker.number)))


def _detector(dictionary: str) -> Any:
    import cv2

    number = getattr(cv2.aruco, dictionary, None)
    if not dictionary.startswith("DICT_") or number is None:
        known = [name for name in dir(cv2.aruco) if name.startswith("DICT_")]
        raise InputError(
            f"there is no marker dictionary {dictionary!r}; {suggestion(dictionary, known)}"
        )
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(number), settings)


def _grey(image: Image) -> Any:
    import cv2

    return cv2.cvtColor(image.pixels, cv2.COLOR_RGB2GRAY)


def _refined(grey: Any, corners: FloatArray, cells: int, camera: CameraModel) -> FloatArray:
    """Return refined corners (4, 2) of a marker as a camera without distortion sees them."""
    if not camera.is_distorted:
        return refine_corners(grey, corners, cells)

    def in_picture(points: FloatArray) -> FloatArray:
        return camera.distort_points(points + 0.5) - 0.5

    return refine_corners(grey, camera.undistort_points(corners + 0.5) - 0.5, cells, in_picture)


def _sighting(image: Image, marker: Marker, corners: FloatArray) -> MarkerSighting | None:
    """Return a marker's sighting, or None without a solution.

    Args:
        image: where it is seen.
        marker: of the map.
        corners: (4, 2) pixels of a camera without distortion.
    """
    import cv2

    half = marker.size / 2.0
    # IPPE_SQUARE requires this order: the marker's frame has x right, y up, z out of it.
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    # OpenCV's origin is the centre of the first pixel, the camera model's origin is its corner.
    seen = corners + 0.5
    count, rotations, translations, errors = cv2.solvePnPGeneric(
        square, seen, image.camera.matrix, None,
        flags=cv2.SOLVEPNP_IPPE_SQUARE,
    )  # fmt: skip
    solutions = []
    for i in range(count):
        optical_from_marker = np.eye(4)
        optical_from_marker[:3, :3] = cv2.Rodrigues(rotations[i])[0]
        optical_from_marker[:3, 3] = np.ravel(translations[i])
        if np.isfinite(optical_from_marker).all():
            solutions.append(_solution(image, marker, optical_from_marker, float(errors[i][0])))
    if not solutions:
        return None
    upright = [solution for solution in solutions if solution.is_upright]
    kept = sorted(upright or solutions, key=lambda solution: solution.candidate.error)
    in_map = map_from_marker(marker)
    corners_in_map = square @ in_map[:3, :3].T + in_map[:3, 3]
    return MarkerSighting(
        image.stamp, marker, kept[0].distance,
        _on_floor([solution.candidate for solution in kept], image, corners_in_map, seen),
    )  # fmt: skip


def _on_floor(
    candidates: list[PoseCandidate], image: Image, corners: FloatArray, pixels: FloatArray
) -> tuple[PoseCandidate, ...]:
    """Return the candidates aligned under the constraint that the base is on the floor."""
    aligned: list[PoseCandidate] = []
    for candidate in candidates:
        found = align_on_floor(candidate.pose, image.camera, corners, pixels)
        if found is not None and found[0].distance_to(candidate.pose) < LARGEST_CORRECTION:
            candidate = PoseCandidate(*found)
        if all(other.pose.distance_to(candidate.pose) > SAME_POSE for other in aligned):
            aligned.append(candidate)
    return tuple(sorted(aligned, key=lambda candidate: candidate.error))


def _solution(
    image: Image, marker: Marker, optical_from_marker: FloatArray, error: float
) -> _Solution:
    optical_from_base = np.linalg.inv(image.camera.base_from_optical())
    map_from_base = map_from_marker(marker) @ np.linalg.inv(optical_from_marker) @ optical_from_base
    forward, up = map_from_base[:3, 0], map_from_base[:3, 2]
    pose = Pose2D(
        float(map_from_base[0, 3]), float(map_from_base[1, 3]), atan2(forward[1], forward[0])
    )
    return _Solution(
        PoseCandidate(pose, error),
        float(np.linalg.norm(optical_from_marker[:3, 3])),
        abs(float(map_from_base[2, 3])),
        acos(min(1.0, max(-1.0, float(up[2])))),
    )


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
