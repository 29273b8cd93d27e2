"""Fiducial markers in images, and the robot poses that follow from the known ones.

Markers are detected with OpenCV's ArucoDetector (S. Garrido-Jurado et al., Pattern Recognition 47,
2014). A caller with a prior selects one of the possible poses.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stack.errors import InputError
from stack.parameters import suggestion
from stack.perception.markers.edges import refine_corners
from stack.perception.markers.joint_pose import joint_fix
from stack.perception.markers.parameters import MarkerParameters
from stack.perception.markers.square_pose import base_candidates, mean_side
from stack.types import CameraModel, FloatArray, Image, Marker, MarkerFix, MarkerSighting
from stack.types.marker_dictionaries import marker_dictionaries


@dataclass(frozen=True, slots=True)
class MarkerDetection:
    """A marker in an image, known or not.

    Attributes:
        dictionary: its OpenCV dictionary.
        number: its id in the dictionary.
        corners: (4, 2) pixels from the image's corner, without its distortion, clockwise from the
            marker's top left one.
    """

    dictionary: str
    number: int
    corners: FloatArray

    @property
    def side(self) -> float:
        """Mean length of the marker's sides, pixels."""
        return mean_side(self.corners)


class MarkerDetector:
    """Detector of markers in camera images."""

    def __init__(
        self, markers: Sequence[Marker], parameters: MarkerParameters | None = None,
        dictionaries: Iterable[str] = (),
    ) -> None:  # fmt: skip
        """Create a detector for the markers of a map.

        Args:
            markers: map frame; numbers are unique within a dictionary.
            parameters: noise and limits.
            dictionaries: of other markers to detect.

        Raises:
            InputError: OpenCV does not have a dictionary.
        """
        self.parameters = parameters or MarkerParameters()
        self._known = {(marker.dictionary, marker.number): marker for marker in markers}
        names = sorted({marker.dictionary for marker in markers} | set(dictionaries))
        self._detectors = {name: _detector(name) for name in names}
        self._last: tuple[Image, tuple[MarkerDetection, ...]] | None = None
        self._sightings: tuple[Image, tuple[MarkerSighting, ...]] | None = None

    def configure(self, parameters: MarkerParameters) -> None:
        """Apply new parameters to the next images."""
        self.parameters = parameters

    def detections(self, image: Image) -> tuple[MarkerDetection, ...]:
        """Return all markers in an image, known or not. The same image is searched only once."""
        if self._last is None or self._last[0] is not image:
            self._last = image, tuple(self._detect(image))
        return self._last[1]

    def sightings(self, image: Image) -> tuple[MarkerSighting, ...]:
        """Return the known markers in an image, nearest first, with their possible base poses."""
        if self._sightings is None or self._sightings[0] is not image:
            self._sightings = image, self._known_in(image)
        return self._sightings[1]

    def fix(self, image: Image) -> MarkerFix | None:
        """Return the base's pose by all known markers in an image; None without one."""
        sightings = [
            one for one in self.sightings(image) if one.distance <= self.parameters.farthest
        ]
        corners = {
            (found.dictionary, found.number): found.corners for found in self.detections(image)
        }
        pixels = [corners[one.marker.dictionary, one.marker.number] for one in sightings]
        return joint_fix(image, sightings, pixels, self.parameters)

    def unknown(self, image: Image) -> tuple[MarkerDetection, ...]:
        """Return the markers in an image that the map does not have."""
        return tuple(
            found
            for found in self.detections(image)
            if (found.dictionary, found.number) not in self._known
        )

    def uncertain(self, image: Image) -> tuple[MarkerDetection, ...]:
        """Return the markers that the map does not have, or only with a standard deviation."""
        return tuple(
            found
            for found in self.detections(image)
            if (marker := self._known.get((found.dictionary, found.number))) is None
            or marker.position_deviation > 0.0
        )

    def _known_in(self, image: Image) -> tuple[MarkerSighting, ...]:
        seen = []
        for found in self.detections(image):
            marker = self._known.get((found.dictionary, found.number))
            if marker is None:
                continue
            solved = base_candidates(marker, image.camera, found.corners, self.parameters)
            if solved is not None:
                seen.append(MarkerSighting(image.stamp, marker, *solved))
        return tuple(sorted(seen, key=lambda s: (s.distance, s.marker.number)))

    def _detect(self, image: Image) -> Iterable[MarkerDetection]:
        import cv2

        if not self._detectors:
            return
        grey: NDArray[np.uint8] = np.asarray(
            cv2.cvtColor(image.pixels, cv2.COLOR_RGB2GRAY), dtype=np.uint8
        )
        for dictionary, detector in self._detectors.items():
            corners, numbers, _ = detector.detectMarkers(grey)
            if numbers is None:
                continue
            cells = int(detector.getDictionary().markerSize) + 2
            for quad, number in zip(corners, np.ravel(numbers), strict=True):
                rough = np.reshape(quad, (4, 2)).astype(float)
                refined = _refined(grey, rough, cells, image.camera)
                # OpenCV's origin is the centre of the first pixel, the camera model's its corner.
                yield MarkerDetection(dictionary, int(number), refined + 0.5)


def _refined(
    grey: NDArray[np.uint8], corners: FloatArray, cells: int, camera: CameraModel
) -> FloatArray:
    """Return refined corners (4, 2) of a marker as a camera without distortion sees them."""
    if not camera.is_distorted:
        return refine_corners(grey, corners, cells)

    def in_picture(points: FloatArray) -> FloatArray:
        return camera.distort_points(points + 0.5) - 0.5

    return refine_corners(grey, camera.undistort_points(corners + 0.5) - 0.5, cells, in_picture)


def _detector(dictionary: str) -> Any:
    import cv2

    known = marker_dictionaries()
    if dictionary not in known:
        raise InputError(
            f"there is no marker dictionary {dictionary!r}; {suggestion(dictionary, known)}"
        )
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(known[dictionary]), settings)
