"""Pose of an upright marker relative to the base, with the distribution of its errors.

Seen from the front, a square's heading hardly changes its image: the reprojection error is flat
between the two mirrored solutions, and its curvature at one of them says little about the errors.
So the likelihood is integrated over the heading: for each heading the best position is found
(profile likelihood), and mean and covariance are those of the normalised profile. Solutions that a
barrier separates stay two candidates; those without one are joined, with a covariance that
contains both. (Mean and covariance by points along the curve, as the unscented transform does: S.
Julier, J. Uhlmann, "Unscented Filtering and Nonlinear Estimation", Proceedings of the IEEE, 2004.)
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import atan2

import numpy as np

from stack.perception.markers.parameters import LARGEST_ERROR, MarkerParameters
from stack.perception.markers.square_pose import square, square_solutions
from stack.types import CameraModel, FloatArray, Marker, Pose2D, RelativePose, wrap_angle

_HEADINGS, _WIDEST = 41, 1.45
"""Headings of a grid; radians between the marker's normal and the line of sight, at most."""

_ROUNDS = 3
"""Gauss-Newton steps for the position at each heading."""

_BARRIER = 1.0
"""Negative log-likelihood between two solutions, above the better one, that keeps them apart."""

_NEGLIGIBLE = 10.0
"""Negative log-likelihood above the best one beyond which a heading is left out."""

_NEAREST = 0.05
"""Metres in front of the camera; points that are nearer have no image."""


def relative_poses(
    size: float, camera: CameraModel, pixels: FloatArray, parameters: MarkerParameters
) -> tuple[float, tuple[RelativePose, ...]] | None:
    """Return a marker's height and its poses relative to the base, the most probable first.

    Args:
        size: side of the marker, metres.
        camera: intrinsics and mount.
        pixels: (4, 2) its corners, from the image's corner.
        parameters: noise of the pixels.

    Returns:
        None if no upright marker in front of the camera explains the corners.
    """
    parts = _parts(size, camera, pixels, parameters)
    if not parts:
        return None
    height = float(parts[0].shares @ parts[0].profile.places[:, 2])
    found = [
        (part, _moments(part, part.profile.places[:, :2], part.profile.headings, part.covariances))
        for part in parts
    ]
    return height, tuple(
        RelativePose(pose, covariance, part.weight) for part, (pose, covariance) in found
    )


def base_poses(
    marker: Marker, camera: CameraModel, pixels: FloatArray, parameters: MarkerParameters
) -> tuple[RelativePose, ...]:
    """Return the base's poses on the map by one marker, with covariances; the most probable first.

    They lie on an arc around the marker, so mean and covariance are computed from points along it.
    None if no upright marker explains the corners.

    Args:
        marker: map frame; the errors of its own pose are not included.
        camera: intrinsics and mount.
        pixels: (4, 2) its corners, from the image's corner.
        parameters: noise of the pixels.
    """
    found = []
    for part in _parts(marker.size, camera, pixels, parameters):
        headings = marker.heading - part.profile.headings
        c, s = np.cos(headings), np.sin(headings)
        turns = np.stack([np.stack([c, -s], axis=1), np.stack([s, c], axis=1)], axis=1)
        moved = np.einsum("nij,nj->ni", turns, part.profile.places[:, :2])
        places = np.array(marker.position[:2]) - moved
        covariances = turns @ part.covariances @ turns.transpose(0, 2, 1)
        pose, covariance = _moments(part, places, headings, covariances)
        found.append(RelativePose(pose, covariance, part.weight))
    return tuple(found)


def _parts(
    size: float, camera: CameraModel, pixels: FloatArray, parameters: MarkerParameters
) -> list[_Part]:
    """Return the parts of the distribution that barriers separate, the most probable first."""
    solutions = square_solutions(size, camera, pixels)
    if not solutions:
        return []
    base_from_optical = camera.base_from_optical()
    placed = [base_from_optical @ solution.optical_from_marker for solution in solutions]
    start, eye = placed[0][:3, 3], base_from_optical[:2, 3]
    towards = atan2(eye[1] - start[1], eye[0] - start[0])
    # The solutions of a near marker lie in valleys that are narrower than the grid.
    turns = [wrap_angle(atan2(one[1, 2], one[0, 2]) - towards) for one in placed]
    grid = np.linspace(-_WIDEST, _WIDEST, _HEADINGS)
    offsets = np.unique([*grid, *(turn for turn in turns if abs(turn) < _WIDEST)])
    view = _View(size, camera, pixels, parameters.pixel_noise)
    coarse = view.profile(towards + offsets, start)
    largest = 2.0 * (LARGEST_ERROR / parameters.pixel_noise) ** 2
    if coarse is None or coarse.costs.min() > largest:
        return []
    fine = []
    for low, high in _valleys(coarse.costs):
        best = low + int(np.argmin(coarse.costs[low : high + 1]))
        ends = coarse.headings[max(0, low - 1)], coarse.headings[min(len(offsets) - 1, high + 1)]
        profile = view.profile(np.linspace(*ends, _HEADINGS), coarse.places[best])
        if profile is not None:
            fine.append((profile, profile.weights(float(coarse.costs.min()))))
    total = sum(float(weights.sum()) for _, weights in fine)
    parts = [_Part(profile, weights / weights.sum(), float(weights.sum()) / total)
             for profile, weights in fine]  # fmt: skip
    return sorted(parts, key=lambda part: -part.weight)


@dataclass(frozen=True)
class _Profile:
    """The best position for each heading.

    Attributes:
        headings: (n,) of the marker's normal, base frame.
        places: (n, 3) x, y and height of its centre, base frame.
        covariances: (n, 3, 3) of the places at that heading.
        costs: (n,) negative log-likelihoods.
    """

    headings: FloatArray
    places: FloatArray
    covariances: FloatArray
    costs: FloatArray

    def weights(self, least: float) -> FloatArray:
        """Return (n,) likelihoods, relative to that of the cost `least`.

        At each heading the likelihood is integrated over the position (Laplace's approximation).
        """
        volumes = np.sqrt(np.linalg.det(self.covariances))
        step = float(self.headings[1] - self.headings[0])
        found: FloatArray = np.exp(least - self.costs) * volumes * step
        return found


@dataclass(frozen=True)
class _Part:
    """A part of the distribution.

    Attributes:
        profile: headings at equal distances.
        shares: (n,) of the headings in it; they add up to 1.
        weight: its share of the whole.
    """

    profile: _Profile
    shares: FloatArray
    weight: float

    @property
    def covariances(self) -> FloatArray:
        """(n, 2, 2) of x and y at each heading."""
        return self.profile.covariances[:, :2, :2]


class _View:
    """The corners of a marker in one picture."""

    def __init__(self, size: float, camera: CameraModel, pixels: FloatArray, noise: float) -> None:
        self._square, self._pixels, self._noise = square(size), pixels, noise
        transform = np.linalg.inv(camera.base_from_optical())
        self._rotation, self._shift = transform[:3, :3], transform[:3, 3]
        self._focal = np.array([camera.fx, camera.fy])
        self._centre = np.array([camera.cx, camera.cy])

    def profile(self, headings: FloatArray, start: FloatArray) -> _Profile | None:
        """Return the best position at each heading (n,); None if one is behind the camera."""
        count = len(headings)
        c, s = np.cos(headings)[:, None], np.sin(headings)[:, None]
        right, up = self._square[:, 0], np.broadcast_to(self._square[:, 1], (count, 4))
        # Seen from the front, the marker's right is to the left of the direction it faces.
        corners = np.stack([-s * right, c * right, up], axis=2)
        places = np.tile(start, (count, 1))
        for _ in range(_ROUNDS):
            seen = self._linearised(corners + places[:, None, :])
            if seen is None:
                return None
            off, jacobian = seen
            normal = np.einsum("nka,nkb->nab", jacobian, jacobian)
            step = np.linalg.solve(normal, np.einsum("nka,nk->na", jacobian, off)[..., None])
            places = places + step[..., 0]
        seen = self._linearised(corners + places[:, None, :])
        if seen is None:
            return None
        off, jacobian = seen
        covariances = np.linalg.inv(np.einsum("nka,nkb->nab", jacobian, jacobian))
        return _Profile(headings, places, covariances, 0.5 * (off**2).sum(axis=1))

    def _linearised(self, corners: FloatArray) -> tuple[FloatArray, FloatArray] | None:
        """Return errors (n, 8) and their derivatives (n, 8, 3) by the place, in deviations."""
        points = corners @ self._rotation.T + self._shift
        depth = points[..., 2:]
        if (depth < _NEAREST).any():
            return None
        expected = self._focal * points[..., :2] / depth + self._centre
        slope = self._rotation[:2] - points[..., :2, None] / depth[..., None] * self._rotation[2]
        jacobian = self._focal[:, None] * slope / depth[..., None] / self._noise
        off = (self._pixels - expected) / self._noise
        return off.reshape(-1, 8), jacobian.reshape(-1, 8, 3)


def _valleys(costs: FloatArray) -> list[tuple[int, int]]:
    """Return the first and last index of what is not negligible in each valley of the costs."""
    inside = costs <= costs.min() + _NEGLIGIBLE
    lows = [
        k for k in range(len(costs))
        if inside[k] and costs[k] == costs[max(0, k - 1) : k + 2].min()
    ]  # fmt: skip
    bounds, bottom = [0], lows[0]
    for low in lows[1:]:
        ridge = bottom + int(np.argmax(costs[bottom : low + 1]))
        if costs[ridge] - max(costs[bottom], costs[low]) > _BARRIER:
            bounds.append(ridge)
            bottom = low
        elif costs[low] < costs[bottom]:
            bottom = low
    bounds.append(len(costs))
    parts = [low + np.flatnonzero(inside[low:high]) for low, high in pairwise(bounds)]
    return [(int(part[0]), int(part[-1])) for part in parts]


def _moments(
    part: _Part, places: FloatArray, headings: FloatArray, covariances: FloatArray
) -> tuple[Pose2D, FloatArray]:
    """Return mean and covariance (3, 3) of poses with the shares of a part.

    They have places (n, 2) with covariances (n, 2, 2), and headings (n,) at equal distances.
    """
    rows = np.column_stack([places, headings])
    mean = part.shares @ rows
    off = rows - mean
    covariance: FloatArray = (off * part.shares[:, None]).T @ off
    covariance[:2, :2] += np.einsum("n,nab->ab", part.shares, covariances)
    covariance[2, 2] += (headings[1] - headings[0]) ** 2 / 12.0  # between two headings of the grid
    x, y, heading = (float(value) for value in mean)
    return Pose2D(x, y, wrap_angle(heading)), covariance
