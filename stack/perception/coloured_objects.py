"""Coloured objects in camera pictures: patches of one hue, and where they stand.

A pixel belongs to a colour by its hue, saturation and brightness (HSV), so the same thresholds hold
in dim and bright light. The object stands on the floor: the lowest pixel of its patch gives its
distance by the height of the camera. Where range sensors return from the same direction at about
that distance, theirs is used, which is more accurate far away.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, hypot, inf

import cv2
import numpy as np
from numpy.typing import NDArray

from stack.perception.colour_parameters import ColourParameters
from stack.perception.hues import has_hue
from stack.types import (
    CameraModel,
    ColourMask,
    Detection,
    FloatArray,
    Image,
    ObjectColour,
    Pose2D,
)

HUE_TOLERANCE, LEAST_SATURATION, LEAST_VALUE = degrees(0.35), 0.5, 0.12 * 255.0
"""Degrees, share of the brightest channel and grey levels of a pixel of an object."""

PIXEL_ERROR = 1.0
"""Standard deviation of the lowest pixel of a patch, pixels."""

RANGE_DEVIATION = 0.03
"""Metres; of a distance from range sensors: noise of the beams and of the pose."""

SAME_OBJECT, SIGMAS = 0.25, 3.0
"""Metres, and standard deviations of the distance by the floor, within which points of range
sensors belong to the patch."""

NEARER = 0.8
"""Distance that is assumed of a patch which the lower border of the picture cuts, as a share of
that of the floor at the border."""

INSET = 0.1
"""Share of a patch's width at each side in which points of range sensors may belong to things
beside it."""

POINTS_ALIKE = 0.1
"""Metres behind the nearest point of range sensors within which others are averaged with it."""


@dataclass(frozen=True, slots=True)
class Patch:
    """Connected pixels.

    Attributes:
        box: left, top, right, bottom, pixels.
        lowest_column: of the lowest pixels; None if the picture ends there.
    """

    box: tuple[int, int, int, int]
    lowest_column: float | None


def colour_mask(pixels: NDArray[np.uint8], colour: ObjectColour) -> NDArray[np.uint8]:
    """Return the pixels of a colour: (height, width) uint8, 1 or 0.

    Args:
        pixels: (height, width, 3) uint8 RGB.
        colour: of the objects.
    """
    smooth = np.asarray(cv2.GaussianBlur(pixels, (3, 3), 0.0), np.uint8)
    limits = HUE_TOLERANCE, LEAST_SATURATION, LEAST_VALUE
    found = has_hue(smooth, colour, *limits).astype(np.uint8)
    mask: NDArray[np.uint8] = cv2.morphologyEx(  # type: ignore[assignment]
        found, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)
    )
    return mask


class ColouredObjectDetector:
    """Detector of coloured objects that stand on the floor.

    Attributes:
        mask: of the last picture, for displays; None before the first one.
    """

    def __init__(self, parameters: ColourParameters) -> None:
        self.parameters = parameters
        self.mask: ColourMask | None = None
        self._last: tuple[Image, str, tuple[Detection, ...]] | None = None

    def configure(self, parameters: ColourParameters) -> None:
        """Apply new parameters from the next picture on."""
        self.parameters, self._last = parameters, None

    def detect(
        self, image: Image, colour: ObjectColour, base: Pose2D, ranges: FloatArray
    ) -> tuple[Detection, ...]:
        """Return the objects of a colour, the nearest first; searches the same picture once.

        Args:
            image: the newest picture.
            colour: of the objects.
            base: at the picture's stamp, map frame.
            ranges: (n, 2) points of the range sensors, base frame, metres.
        """
        last = self._last
        if last is None or last[0] is not image or last[1] != colour:
            self._last = last = image, colour, self._found(image, colour, base, ranges)
        return last[2]

    def recent(self, stamp: float) -> tuple[Detection, ...]:
        """Return the objects in the last picture if it is not older than a stamp, seconds."""
        return self._last[2] if self._last is not None and self._last[0].stamp >= stamp else ()

    def _found(
        self, image: Image, colour: ObjectColour, base: Pose2D, ranges: FloatArray
    ) -> tuple[Detection, ...]:
        p, camera = self.parameters, image.camera
        mask = colour_mask(image.pixels, colour)
        self.mask = ColourMask(colour, image.stamp, mask)
        found = []
        for patch in _patches(mask, p.least_pixels):
            place = placed(patch, camera, ranges)
            if place is None or place[1] > p.farthest:
                continue
            point, distance, deviation = place
            width, height = size_of(patch.box, camera, distance)
            if max(width, height) < p.least_size:
                continue
            x, y = base.transform(point[None])[0].tolist()
            found.append(
                Detection(colour, image.stamp, (x, y), deviation, width, height, patch.box)
            )
        return tuple(sorted(found, key=lambda item: item.distance_to(base.x, base.y)))


def _patches(mask: NDArray[np.uint8], least: int) -> list[Patch]:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    rows, found = mask.shape[0], []
    for number in range(1, count):
        left, top, width, height, area = (int(value) for value in stats[number])
        if area < least:
            continue
        bottom = top + height
        lowest = np.flatnonzero(labels[bottom - 1, left : left + width] == number)
        column = None if bottom >= rows else left + float(lowest.mean()) + 0.5
        found.append(Patch((left, top, left + width, bottom), column))
    return found


def placed(
    patch: Patch, camera: CameraModel, ranges: FloatArray
) -> tuple[FloatArray, float, float] | None:
    """Return point (2,) in the base frame, distance from the camera and its deviation, metres.

    The point is in the middle of the patch's width. None: neither the floor nor a range sensor
    tells how far away it is.
    """
    expected, error = inf, inf
    left, _, right, bottom = patch.box
    middle = (left + right) / 2
    column, eye = patch.lowest_column, np.array(camera.position[:2])
    away = _floor_distance(camera, middle if column is None else column, bottom)
    if away is not None and column is None:  # it stands nearer than the lowest visible floor
        expected, error = NEARER * away, (1.0 - NEARER) * away
    elif away is not None:
        expected = away
        error = PIXEL_ERROR * expected**2 / (camera.fy * camera.position[2])
    measured = _range(patch, camera, ranges - eye, expected, SAME_OBJECT + SIGMAS * error)
    if measured is not None:
        expected, error = measured, RANGE_DEVIATION
    if expected == inf:
        return None
    x, y, _ = _level_ray(patch, camera, middle)
    return eye + expected * np.array([x, y]) / hypot(x, y), expected, error


def _ray(camera: CameraModel, column: float, row: float) -> FloatArray:
    """Return the direction (3,) of a point of the picture, base frame, not normalised."""
    x, y = camera.rays(np.array([[column, row]]))[0]
    direction: FloatArray = camera.base_from_optical()[:3, :3] @ np.array([x, y, 1.0])
    return direction


def size_of(
    box: tuple[float, float, float, float], camera: CameraModel, distance: float
) -> tuple[float, float]:
    """Return width and height of what a box in the picture shows at a distance, metres.

    Args:
        box: left, top, right, bottom, pixels.
        camera: that has taken the picture.
        distance: metres.
    """
    left, top, right, bottom = box
    if not camera.is_distorted:
        return distance / camera.fx * (right - left), distance / camera.fy * (bottom - top)
    row, column = (top + bottom) / 2, (left + right) / 2
    ends = camera.rays(np.array([[left, row], [right, row], [column, top], [column, bottom]]))
    return float(distance * (ends[1, 0] - ends[0, 0])), float(distance * (ends[3, 1] - ends[2, 1]))


def _level_ray(patch: Patch, camera: CameraModel, column: float) -> FloatArray:
    """Return the direction (3,) of a column of a patch along the camera's axis, base frame."""
    _, top, _, bottom = patch.box
    x = camera.rays(np.array([[column, (top + bottom) / 2]]))[0, 0]
    direction: FloatArray = camera.base_from_optical()[:3, :3] @ np.array([x, 0.0, 1.0])
    return direction


def _floor_distance(camera: CameraModel, column: float, row: float) -> float | None:
    """Return how far away a point of the picture shows the floor, metres; None: nowhere."""
    x, y, z = _ray(camera, column, row)
    return None if z > -1e-3 else float(hypot(x, y) * camera.position[2] / -z)


def _range(
    patch: Patch, camera: CameraModel, points: FloatArray, expected: float, slack: float
) -> float | None:
    """Return the mean distance of the nearest points in the patch's directions, metres.

    The points (n, 2) are seen from the camera, in directions of the base frame. Their distances
    differ by `slack` metres at most from the expected one; inf: unknown.
    """
    left, _, right, _ = patch.box
    margin = INSET * (right - left)
    first, last = (
        np.arctan2(ray[1], ray[0])
        for ray in (
            _level_ray(patch, camera, right - margin),
            _level_ray(patch, camera, left + margin),
        )
    )
    distances = np.hypot(points[:, 0], points[:, 1])
    bearings = np.arctan2(points[:, 1], points[:, 0])
    inside = (np.mod(bearings - first, 2.0 * np.pi) <= np.mod(last - first, 2.0 * np.pi)) & (
        distances > 0.0
    )
    if expected < inf:
        inside &= np.abs(distances - expected) <= slack
    if not inside.any():
        return None
    alike = inside & (distances <= distances[inside].min() + POINTS_ALIKE)
    return float(distances[alike].mean())
