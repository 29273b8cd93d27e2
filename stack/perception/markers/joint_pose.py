"""One base pose from all markers in a picture.

The corners of all markers are fitted together, so that a board of several markers counts as one
large target. One marker alone has the distribution of `relative_pose`. A marker that is not where
the map says does not fit together with the others and is left out: of all starts, the pose with the
smallest truncated reprojection errors wins (MSAC, P. Torr, A. Zisserman, "MLESAC", Computer Vision
and Image Understanding 78, 2000, with every solution of a single marker as a start).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stack.perception.markers.parameters import LARGEST_ERROR, MarkerParameters
from stack.perception.markers.planar_pose import FloorFit, align_on_floor, project
from stack.perception.markers.relative_pose import base_poses
from stack.perception.markers.square_pose import (
    SAME_POSE,
    candidates_of,
    corners_in_map,
    shared_covariance,
)
from stack.types import (
    CameraModel,
    FloatArray,
    Image,
    Marker,
    MarkerFix,
    MarkerSighting,
    Pose2D,
    PoseCandidate,
)

_STARTS = 4
"""Markers, the nearest ones, whose solutions are starts."""

_NEAR_START = 40.0
"""Pixels; a marker farther from where a start expects it is left out at first."""

_WORSE = 4.0
"""A second pose counts while its error is at most this many times that of the best one."""


def joint_fix(
    image: Image, sightings: Sequence[MarkerSighting], pixels: Sequence[FloatArray],
    parameters: MarkerParameters,
) -> MarkerFix | None:  # fmt: skip
    """Return the poses that explain all sightings of an image; None if nothing does.

    Args:
        image: stamp and camera.
        sightings: the nearest first.
        pixels: (4, 2) corners of each, from the image's corner.
        parameters: noise and limits.
    """
    if not sightings:
        return None
    markers = [sighting.marker for sighting in sightings]
    picture = _Picture(image.camera, markers, pixels, parameters)
    starts = [one.pose for sighting in sightings[:_STARTS] for one in sighting.candidates]
    found = [fitted for start in starts if (fitted := picture.fitted(start)) is not None]
    if not found:
        return None
    _, chosen, _ = min(found, key=lambda one: one[0])
    fits: list[FloorFit] = []
    for _, used, fit in sorted(found, key=lambda one: one[0]):
        is_new = all(fit.pose.distance_to(other.pose) > SAME_POSE for other in fits)
        if used == chosen and is_new and len(fits) < 2:
            fits.append(fit)
    least = max(fits[0].error, parameters.pixel_noise)
    fits = [fit for fit in fits if fit.error <= _WORSE * least]
    explained = tuple(markers[i] for i in chosen)
    candidates: tuple[PoseCandidate, ...] = ()
    if len(chosen) == 1:
        candidates = _by_one(image.camera, explained[0], pixels[chosen[0]], fits, parameters)
    return MarkerFix(image.stamp, explained, candidates or candidates_of(fits, parameters))


def _by_one(
    camera: CameraModel, marker: Marker, pixels: FloatArray, fits: Sequence[FloorFit],
    parameters: MarkerParameters,
) -> tuple[PoseCandidate, ...]:  # fmt: skip
    """Return the base's poses by one marker; none if no upright marker explains its corners."""
    on_map = np.square([marker.position_deviation] * 2 + [marker.heading_deviation])
    found = []
    for one in base_poses(marker, camera, pixels, parameters):
        off = np.subtract(marker.position[:2], (one.pose.x, one.pose.y))
        # An error of the marker's position moves the base; turned, the base goes round the marker.
        lever = np.array([[1.0, 0.0, off[1]], [0.0, 1.0, -off[0]], [0.0, 0.0, 1.0]])
        covariance = one.covariance + (lever * on_map) @ lever.T + shared_covariance(parameters)
        error = min(fits, key=lambda fit: fit.pose.distance_to(one.pose)).error
        found.append(PoseCandidate(one.pose, error, covariance, one.share))
    return tuple(found)


@dataclass(frozen=True)
class _Picture:
    """The markers in a picture.

    Attributes:
        camera: model and mount.
        markers: the nearest first.
        pixels: (4, 2) corners of each.
        parameters: noise and limits.
    """

    camera: CameraModel
    markers: Sequence[Marker]
    pixels: Sequence[FloatArray]
    parameters: MarkerParameters

    def fitted(self, start: Pose2D) -> tuple[float, tuple[int, ...], FloorFit] | None:
        """Fit all markers that agree near a start: truncated cost, their indices, and the fit."""
        limit, used = LARGEST_ERROR, self._near(start)
        fit = self._fit(start, used)
        while fit is not None:
            errors = np.sqrt((fit.residuals.reshape(-1, 4, 2) ** 2).sum(axis=2).mean(axis=1))
            if errors.max() <= limit:
                break
            if len(used) == 1:
                return None
            worst = int(np.argmax(errors))
            used = tuple(index for n, index in enumerate(used) if n != worst)
            fit = self._fit(start, used)
        if fit is None:
            return None
        cost = (fit.residuals**2).sum() / 4.0 + limit**2 * (len(self.markers) - len(used))
        return float(cost), used, fit

    def _near(self, start: Pose2D) -> tuple[int, ...]:
        """Return the indices of the markers that are about where a pose expects them."""
        near = []
        for index, marker in enumerate(self.markers):
            projected = project(_at(start), self.camera, corners_in_map(marker))
            if projected is None:
                continue
            if np.abs(projected[0] - self.pixels[index]).max() <= _NEAR_START:
                near.append(index)
        return tuple(near)

    def _fit(self, start: Pose2D, used: tuple[int, ...]) -> FloorFit | None:
        if not used:
            return None
        chosen = [self.markers[i] for i in used]
        corners = np.concatenate([corners_in_map(marker) for marker in chosen])
        seen = np.concatenate([self.pixels[i] for i in used])
        noise = self.parameters.pixel_noise**2 * np.eye(2 * len(seen))
        fit = align_on_floor(start, self.camera, corners, seen, noise)
        if fit is None or not any(m.position_deviation or m.heading_deviation for m in chosen):
            return fit
        misplaced = _misplacement(fit.pose, self.camera, chosen)
        if misplaced is None:
            return None
        return align_on_floor(fit.pose, self.camera, corners, seen, noise + misplaced)


def _at(pose: Pose2D) -> FloatArray:
    """Return the unknowns (4,) of a pose, without a vertical shift of the picture."""
    return np.array([pose.x, pose.y, pose.heading, 0.0])


def _misplacement(
    pose: Pose2D, camera: CameraModel, markers: Sequence[Marker]
) -> FloatArray | None:
    """Return the covariance (8n, 8n) of the corners that errors of the map cause, px².

    An error of a marker's pose moves its four corners together: J Σ Jᵀ, where J is the Jacobian of
    the corners by the marker's x, y and heading.
    """
    total = np.zeros((8 * len(markers), 8 * len(markers)))
    for n, marker in enumerate(markers):
        projected = project(_at(pose), camera, corners_in_map(marker))
        if projected is None:
            return None
        by_base = projected[1]
        # moving the marker is moving the base the other way; turning it is turning the base about
        # the marker the other way
        off = np.array(marker.position[:2]) - (pose.x, pose.y)
        turn = by_base[:, 2] + by_base[:, :2] @ np.array([off[1], -off[0]])
        jacobian = -np.column_stack([by_base[:, :2], turn])
        deviations = marker.position_deviation, marker.position_deviation, marker.heading_deviation
        own = slice(8 * n, 8 * n + 8)
        total[own, own] = (jacobian * np.square(deviations)) @ jacobian.T
    return total
