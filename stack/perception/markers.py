"""Where the robot must be to see a known fiducial marker the way it does.

Markers are found with OpenCV's ArucoDetector (S. Garrido-Jurado et al., Pattern Recognition 47,
2014); the camera's pose comes from IPPE for squares (T. Collins, A. Bartoli, "Infinitesimal
Plane-Based Pose Estimation", IJCV 109, 2014). A square seen from afar has two poses that look
nearly alike, one mirrored at the line of sight: both are returned, and a caller with a prior
takes the one that fits it.
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
from stack.types import FloatArray, Image, Marker, MarkerSighting, Pose2D, PoseCandidate

LARGEST_HEIGHT_ERROR = 0.3
"""Metres by which a solution's camera height may disagree with the camera's mount."""

LARGEST_TILT = 0.52
"""Radians (30 degrees) by which a solution may tilt the base out of the floor's plane."""


LARGEST_CORRECTION = 0.5
"""Metres by which the floor may correct a solution; more means it went astray."""

SAME_POSE = 0.02
"""Metres between two solutions that the floor has made one."""


@dataclass(frozen=True, slots=True)
class _Solution:
    """A base pose in the map frame, and how far it is from standing on the floor."""

    candidate: PoseCandidate
    distance: float
    height_error: float
    tilt: float

    @property
    def is_upright(self) -> bool:
        return self.height_error <= LARGEST_HEIGHT_ERROR and self.tilt <= LARGEST_TILT


class MarkerDetector:
    """Finds known markers in camera pictures."""

    def __init__(self, markers: Sequence[Marker]) -> None:
        """Takes the markers of a place.

        Args:
            markers: map frame; one number may stand once per dictionary.

        Raises:
            InputError: a dictionary that OpenCV does not have.
        """
        self._known = {(marker.dictionary, marker.number): marker for marker in markers}
        names = sorted({marker.dictionary for marker in markers})
        self._detectors = {name: _detector(name) for name in names}

    def sightings(self, image: Image) -> tuple[MarkerSighting, ...]:
        """The known markers in a picture, nearest first, each with its possible base poses."""
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
                    quad = refine_corners(grey, np.reshape(quad, (4, 2)).astype(float), cells)
                    found.append(_sighting(image, marker, quad))
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


def _sighting(image: Image, marker: Marker, corners: FloatArray) -> MarkerSighting | None:
    """A marker's sighting from its corners in pixels (4, 2); None when no solution exists."""
    import cv2

    half = marker.size / 2.0
    # IPPE_SQUARE wants them in this order: the marker's frame has x right, y up, z out of it.
    square = np.array([[-half, half, 0], [half, half, 0], [half, -half, 0], [-half, -half, 0]])
    # OpenCV counts from pixels' centres, the camera model's middle of the image from their edges.
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
    """The candidates aligned under the constraint that the base stands on the floor."""
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
    """(4, 4) transform of a marker's frame (x right, y up, z out of it) to the map frame."""
    c, s = cos(marker.heading), sin(marker.heading)
    transform = np.eye(4)
    # Seen from in front, the marker's right is to the left of the way it faces.
    transform[:3, 0] = [-s, c, 0.0]
    transform[:3, 1] = [0.0, 0.0, 1.0]
    transform[:3, 2] = [c, s, 0.0]
    transform[:3, 3] = marker.position
    return transform
